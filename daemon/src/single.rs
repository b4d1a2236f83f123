//! `suture repair` and `suture inspect`: files named on the command line, each in a supervised worker process. How several are done
//! side by side is [`crate::batch`]'s business, what is done for one [`crate::item`]'s.

use std::path::Path;

use suture_core::Profile;
use suture_core::report::Certificate;

use crate::batch::Batch;
use crate::cli::{InspectArgs, RepairArgs};
use crate::exit::Exit;
use crate::item::Order;
use crate::naming::Naming;
use crate::profiles;
use crate::say::complain;
use crate::signals::Stop;

/// Repairs every input and prints what was done.
pub(crate) fn repair(args: &RepairArgs) -> Exit {
    let order = profiles::of_command(&args.profile, args.no_self_intersections).and_then(|mut profile| {
        profile.guarantee = args.guarantee.map_or(profile.guarantee, Into::into);
        let naming = Some(Naming::new(args)?);
        let limits = args.spend.limits(args.list_edit);
        Ok(Order { inputs: &args.inputs, profile, limits, naming, certificate: None, json: args.json })
    });
    carry_out(order)
}

/// Diagnoses every input, or checks the certificate of one.
pub(crate) fn inspect(args: &InspectArgs) -> Exit {
    let claim = args.certificate.as_deref().map(|report| match args.inputs.as_slice() {
        [_] => claim_in(report),
        _ => Err("a certificate is of one file: name only that".into()),
    });
    let order = claim.transpose().and_then(|claim| {
        let mut profile = profiles::of_command(&args.profile, args.no_self_intersections)?;
        if let Some(claim) = &claim {
            profile.check_self_intersections = claim.certificate.covers_self_intersection();
        }
        let (limits, certificate) = (args.spend.limits(false), claim.map(|claim| claim.certificate));
        Ok(Order { inputs: &args.inputs, profile, limits, naming: None, certificate, json: args.json })
    });
    let exit = carry_out(order);
    match (&args.certificate, &args.original) {
        (Some(report), Some(original)) if exit == Exit::Good => again(args, report, original),
        _ => exit,
    }
}

/// Repairs the original anew, as the report says that it was done, and holds the certificate against what comes of it.
fn again(args: &InspectArgs, report: &Path, original: &Path) -> Exit {
    let inputs = [original.to_owned()];
    let prepared = claim_in(report).and_then(|claim| {
        let folder = tempfile::tempdir().map_err(|e| format!("no folder for the repair: {e}"))?;
        Ok((claim, folder))
    });
    let (claim, folder) = match prepared {
        Ok(prepared) => prepared,
        Err(line) => return carry_out(Err(line)),
    };
    carry_out(Ok(Order {
        inputs: &inputs,
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
