//! `suture repair` and `suture inspect`: files named on the command line, each in a supervised worker process. How several are done
//! side by side is [`crate::batch`]'s business, what is done for one [`crate::item`]'s.

use std::path::Path;

use suture_core::report::Certificate;
use suture_core::residue::Brush;
use suture_core::{OutputFormat, Profile, ResidueSettings};

use crate::batch::Batch;
use crate::cli::meshes::{DefeatureArgs, InspectArgs, RepairArgs, ResidueArgs, SimplifyArgs, SmoothArgs};
use crate::exit::Exit;
use crate::fsx;
use crate::item::Order;
use crate::naming::Naming;
use crate::profiles;
use crate::say::complain;
use crate::signals::Stop;

/// Repairs every input and prints what was done.
pub(crate) fn repair(args: &RepairArgs) -> Exit {
    repair_under(args, |_| Ok(()))
}

/// Repairs every input, and removes small features.
pub(crate) fn defeature(args: &DefeatureArgs) -> Exit {
    repair_under(&args.repair, |profile| {
        let limits = [
            (args.holes_below, &mut profile.remove_holes_below_mm),
            (args.fillets_below, &mut profile.remove_fillets_below_mm),
            (args.grooves_below, &mut profile.remove_grooves_below_mm),
            (args.bosses_below, &mut profile.remove_bosses_below_mm),
        ];
        let mut any = false;
        for (asked, limit) in limits {
            *limit = asked.unwrap_or(*limit);
            any |= *limit > 0.0;
        }
        let help =
            "give at least one of --holes-below, --fillets-below, --grooves-below, --bosses-below, or a profile that says it";
        if any { Ok(()) } else { Err(format!("no feature is to be removed: {help}")) }
    })
}

/// Repairs every input, and makes its triangles fewer.
pub(crate) fn simplify(args: &SimplifyArgs) -> Exit {
    repair_under(&args.repair, |profile| {
        if args.triangles.is_some() || args.ratio.is_some() || args.max_deviation.is_some() {
            profile.simplify_triangles = args.triangles.unwrap_or(0);
            profile.simplify_ratio = args.ratio.unwrap_or(0.0);
            profile.simplify_within_mm = args.max_deviation.unwrap_or(0.0);
        }
        profile.keep_edges_degrees = args.edges.keep_edges.unwrap_or(profile.keep_edges_degrees);
        let is_wanted = profile.simplify_triangles > 0 || profile.simplify_ratio > 0.0 || profile.simplify_within_mm > 0.0;
        let help = "give --triangles, --ratio or --max-deviation, or a profile that says it";
        if is_wanted { Ok(()) } else { Err(format!("nothing says how few triangles are wanted: {help}")) }
    })
}

/// Repairs every input, and smooths its waves.
pub(crate) fn smooth(args: &SmoothArgs) -> Exit {
    repair_under(&args.repair, |profile| {
        profile.smooth_waves_below_mm = args.waves_below.unwrap_or(profile.smooth_waves_below_mm);
        profile.smooth_leaves = args.leave.unwrap_or(profile.smooth_leaves);
        profile.keep_edges_degrees = args.edges.keep_edges.unwrap_or(profile.keep_edges_degrees);
        let is_wanted = profile.smooth_waves_below_mm > 0.0;
        let help = "give --waves-below, or a profile that says it";
        if is_wanted { Ok(()) } else { Err(format!("nothing says which waves are to be smoothed: {help}")) }
    })
}

/// Repairs every input, and removes the residue of a tool.
pub(crate) fn residue(args: &ResidueArgs) -> Exit {
    repair_under(&args.repair, |profile| {
        let settings = &mut profile.residue;
        for (given, setting) in
            [(&args.toolpath, &mut settings.toolpath), (&args.brush, &mut settings.brush), (&args.mask, &mut settings.mask)]
        {
            if let Some(path) = given {
                *setting = path.to_str().ok_or_else(|| format!("{}: its name is no text", path.display()))?.into();
            }
        }
        corrections(settings)?;
        settings.tools.extend(args.tools.iter().cloned());
        settings.tolerance_mm = args.tolerance.unwrap_or(settings.tolerance_mm);
        settings.include.extend(&args.include);
        settings.exclude.extend(&args.exclude);
        if args.without_path {
            settings.toolpath.clear();
            settings.without_path = true;
        }
        let is_wanted = !settings.toolpath.is_empty() || settings.without_path;
        let help = "give --toolpath, or a profile that says it; or --without-path, to be told where waves are";
        if is_wanted { Ok(()) } else { Err(format!("no tool path is named: {help}")) }
    })
}

/// Looks at files of corrections before any work begins; those with a star are of each mesh, and looked at with it.
fn corrections(settings: &ResidueSettings) -> Result<(), String> {
    let is_one = |path: &&String| !path.is_empty() && !path.contains('*');
    let unread = |path: &str, error: std::io::Error| format!("{path}: cannot be read: {error}");
    if let Some(path) = Some(&settings.brush).filter(is_one) {
        let text = std::fs::read(path).map_err(|error| unread(path, error))?;
        Brush::parse(&text).map_err(|error| format!("{path}: {error}"))?;
    }
    if let Some(path) = Some(&settings.mask).filter(is_one) {
        let is_file = std::fs::File::open(path).and_then(|file| file.metadata()).map_err(|error| unread(path, error))?.is_file();
        if !is_file {
            return Err(format!("{path}: is no file"));
        }
    }
    Ok(())
}

/// Repairs every input under the profile of the command line, which `change` changes.
fn repair_under(args: &RepairArgs, change: impl FnOnce(&mut Profile) -> Result<(), String>) -> Exit {
    let order = profiles::of_command(&args.profile, args.no_self_intersections).and_then(|mut profile| {
        change(&mut profile)?;
        profile.guarantee = args.guarantee.map_or(profile.guarantee, Into::into);
        let of_name = || args.output.extension().and_then(|ending| OutputFormat::of_ending(ending.to_str()?));
        let is_folder = fsx::is_folder(&args.output).unwrap_or(false);
        let of_name = of_name().filter(|_| !is_folder);
        if let (Some(wanted), Some(ending)) = (args.format, of_name) {
            agree(wanted, ending, &args.output)?;
        }
        profile.format = args.format.or(of_name).unwrap_or(profile.format);
        let naming = Some(Naming::new(args, profile.format)?);
        let limits = args.spend.limits(args.list_edit);
        Ok(Order { inputs: &args.inputs, profile, limits, naming, certificate: None, json: args.json })
    });
    carry_out(order)
}

/// The format that is asked for is that of the output's ending.
fn agree(wanted: OutputFormat, ending: OutputFormat, output: &Path) -> Result<(), String> {
    if wanted == ending || wanted == OutputFormat::Input {
        return Ok(());
    }
    Err(format!("{}: `--format` wants another format than its ending says; change one of them", output.display()))
}

/// Diagnoses every input, or checks the certificate of one.
pub(crate) fn inspect(args: &InspectArgs) -> Exit {
    let claim = args.certificate.as_deref().map(|report| match args.inputs.as_slice() {
        [_] => claim_in(report),
        _ => Err("a certificate is of one file: name only that".into()),
    });
    let claim = match claim.transpose() {
        Ok(claim) => claim,
        Err(line) => return carry_out(Err(line)),
    };
    let order = profiles::of_command(&args.profile, args.no_self_intersections).map(|mut profile| {
        let certificate = claim.as_ref().map(|claim| claim.certificate.clone());
        if let Some(certificate) = &certificate {
            profile.check_self_intersections = certificate.covers_self_intersection();
        }
        Order { inputs: &args.inputs, profile, limits: args.spend.limits(false), naming: None, certificate, json: args.json }
    });
    let exit = carry_out(order);
    match (claim, &args.original) {
        (Some(claim), Some(original)) if exit == Exit::Good => again(args, claim, original),
        _ => exit,
    }
}

/// Repairs the original anew, as the report says that it was done, and holds the certificate against what comes of it.
fn again(args: &InspectArgs, claim: Claim, original: &Path) -> Exit {
    let folder = match tempfile::tempdir() {
        Ok(folder) => folder,
        Err(error) => return carry_out(Err(format!("no folder for the repair: {error}"))),
    };
    carry_out(Ok(Order {
        inputs: &[original.to_owned()],
        profile: claim.profile,
        limits: args.spend.limits(false),
        naming: Some(Naming::of_file(folder.path().join("again.stl"))),
        certificate: Some(claim.certificate),
        json: false,
    }))
}

/// What a report says of a file: its certificate, and the profile under which it was made.
struct Claim {
    profile: Profile,
    certificate: Certificate,
}

/// The claim that stands in a report.
fn claim_in(report: &Path) -> Result<Claim, String> {
    #[derive(serde::Deserialize)]
    struct Part {
        profile: Profile,
        certificate: Option<Certificate>,
    }
    let shown = report.display();
    let file = std::fs::File::open(report).map_err(|e| format!("{shown}: cannot be read: {e}"))?;
    // A report may list an edit as large as the mesh: it is passed over.
    let part: Part = serde_json::from_reader(std::io::BufReader::new(file)).map_err(|e| format!("{shown}: is no report: {e}"))?;
    let certificate = part.certificate.ok_or_else(|| format!("{shown}: has no certificate in it"))?;
    Ok(Claim { profile: part.profile, certificate })
}

fn carry_out(order: Result<Order, String>) -> Exit {
    let ready = order.and_then(|order| {
        let stop = Stop::listen().map_err(|e| format!("cannot listen for signals: {e}"))?;
        Ok((order, stop))
    });
    match ready {
        Ok((order, stop)) => Batch::new(&order, &stop).run(),
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}
