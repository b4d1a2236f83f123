//! `suture repair` and `suture inspect`: files named on the command line, each in a supervised worker process. How several are done
//! side by side is [`crate::batch`]'s business, what is done for one [`crate::item`]'s.

use std::path::Path;

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
    let certificate = args.certificate.as_deref().map(|report| match args.inputs.as_slice() {
        [_] => certificate_in(report),
        _ => Err("a certificate is of one file: name only that".into()),
    });
    let order = certificate.transpose().and_then(|certificate| {
        let mut profile = profiles::of_command(&args.profile, args.no_self_intersections)?;
        if let Some(certificate) = &certificate {
            profile.check_self_intersections = certificate.covers_self_intersection();
        }
        let limits = args.spend.limits(false);
        Ok(Order { inputs: &args.inputs, profile, limits, naming: None, certificate, json: args.json })
    });
    carry_out(order)
}

/// The certificate that stands in a report.
fn certificate_in(report: &Path) -> Result<Certificate, String> {
    #[derive(serde::Deserialize)]
    struct Part {
        certificate: Option<Certificate>,
    }
    let shown = report.display();
    let file = std::fs::File::open(report).map_err(|e| format!("{shown}: cannot be read: {e}"))?;
    // A report may list an edit as large as the mesh: it is passed over.
    let part: Part = serde_json::from_reader(std::io::BufReader::new(file)).map_err(|e| format!("{shown}: is no report: {e}"))?;
    part.certificate.ok_or_else(|| format!("{shown}: has no certificate in it"))
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
