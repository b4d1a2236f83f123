//! `suture convert`: one mesh in another format.

use suture_core::report::{Converted, FileFacts};
use suture_core::{OutputFormat, Quiet, words};

use crate::cli::meshes::ConvertArgs;
use crate::draft::Draft;
use crate::exit::Exit;
use crate::fsx;
use crate::naming;
use crate::say::{complain, plain, print};
use crate::table::format_name;
use crate::units::{WRITTEN, show_size};

/// Writes what the command line asks for.
pub(crate) fn run(args: &ConvertArgs) -> Exit {
    match convert(args) {
        Ok(Converted { input, output, attributes_lost, .. }) => {
            let of = |facts: &FileFacts| format!("{}, {}", show_size(facts.bytes), format_name(facts.format));
            let (from, to) = (args.input.display(), args.output.display());
            let first = format!("{from}: {}, {} -> {to}: {}", words::triangles(input.triangles), of(&input), of(&output));
            let lost = (attributes_lost > 0)
                .then(|| format!("  lost: colours, paint or other attributes of {}", words::triangles(attributes_lost)));
            let findings = input.findings.iter().map(|finding| format!("  {finding}"));
            let lines = std::iter::once(first).chain(findings).chain(lost);
            let text: String = lines.map(|line| plain(&line) + "\n").collect();
            print(text.as_bytes(), Exit::Good)
        }
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

fn convert(args: &ConvertArgs) -> Result<Converted, String> {
    let (input, output) = (&args.input, &args.output);
    let shown = output.display();
    let ending = output.extension().and_then(|ending| OutputFormat::of_ending(ending.to_str()?));
    let format =
        ending.ok_or_else(|| format!("{shown}: its ending says no format that meshes are converted to; one of {WRITTEN}"))?;
    naming::check_one(std::slice::from_ref(input), output, args.force)?;
    let failed = |error: std::io::Error| format!("{shown}: cannot be written: {error}");
    let draft = Draft::new(fsx::folder_of(output)).map_err(failed)?;
    let mut limits = args.spend.limits(false);
    limits.spool.get_or_insert_with(|| fsx::folder_of(output).to_owned());
    let converted =
        suture_core::convert(input, &draft.path(), format, &limits, &Quiet).map_err(|error| draft.told(&error, output))?;
    draft.place_like(input, output, args.force).map_err(failed)?;
    Ok(converted)
}
