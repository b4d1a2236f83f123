//! Packages that lead somewhere else than they should.

use std::path::Path;

use super::super::archive::Archive;
use super::super::archive::build::{Member, member, zip};
use super::super::spool::Context;
use super::*;
use crate::contract::error::{Error, Result};
use crate::contract::progress::Quiet;
use crate::contract::settings::Limits;

const TYPES: &str = "<Types xmlns='http://schemas.openxmlformats.org/package/2006/content-types'/>";
const MODEL: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

fn relationships(found: &[(&str, &str, &str)]) -> String {
    let inner: String = found
        .iter()
        .map(|(kind, target, rest)| format!("<Relationship Id='r' Type='{kind}' Target='{target}' {rest}/>"))
        .collect();
    format!("<Relationships xmlns='http://schemas.openxmlformats.org/package/2006/relationships'>{inner}</Relationships>")
}

fn package(root: &[(&str, &str, &str)], others: &[Member]) -> Vec<u8> {
    let own = [member("[Content_Types].xml", TYPES), member("_rels/.rels", relationships(root))];
    zip(&[own.as_slice(), others].concat())
}

/// What `look` sees of a package.
fn opened<R>(bytes: &[u8], look: impl FnOnce(&mut Opc<'_>, &Context<'_>) -> Result<R>) -> Result<R> {
    let (limits, folder) = (Limits::default(), std::env::temp_dir());
    let context = Context { path: Path::new("a.3mf"), spool: &folder, limits: &limits, progress: &Quiet, passed: None };
    let archive = Archive::open(bytes).map_err(|rejection| rejection.at(context.path))?;
    look(&mut Opc::open(archive, &context)?, &context)
}

fn reason<R>(result: Result<R>) -> String {
    match result {
        Err(Error::Unreadable { reason, .. }) => reason,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it is read"),
    }
}

#[test]
fn the_start_part_is_the_one_that_the_package_names() {
    let parts = [member("3D/x.model", "text"), member("3D/_rels/x.model.rels", relationships(&[("k", "y.model", "")]))];
    let bytes = package(&[("other", "/3D/y.model", ""), (MODEL, "/3d/X.model", "")], &parts);
    let seen = opened(&bytes, |package, context| {
        let start = package.start.clone();
        let text = package.spooled(&start, context)?.all().as_flattened().to_vec();
        Ok((start.clone(), text, package.signed, package.findings.len()))
    });
    assert_eq!(seen.unwrap(), ("3D/x.model".into(), b"text".to_vec(), false, 0));
}

#[test]
fn a_start_part_that_is_nowhere_is_refused() {
    let part = [member("3D/x.model", "text")];
    for (root, word) in [
        (vec![], "no 3MF package"),
        (vec![(MODEL, "/3D/y.model", "")], "y.model\", is not in it"),
        (vec![(MODEL, "/../x.model", "")], "is not in it"),
        (vec![(MODEL, "/3D/x.model", ""), (MODEL, "/3D/z.model", "")], "2 parts"),
        (vec![(MODEL, "http://elsewhere/x.model", "TargetMode='External'")], "outside"),
    ] {
        let reason = reason(opened(&package(&root, &part), |_, _| Ok(())));
        assert!(reason.contains(word), "{word}: {reason}");
    }
    let usual = opened(&package(&[], &[member("3D/3dmodel.model", "")]), |package, _| Ok(package.findings.len()));
    assert_eq!(usual.unwrap(), 1);
}

#[test]
fn signatures_are_told_and_encrypted_parts_are_not_read() {
    let parts = [member("3D/x.model", "text"), member("3D/secret.model", "%3McF\0\0\0?"), member("Secure/keystore.xml", "")];
    let root = [
        (MODEL, "/3D/x.model", ""),
        ("http://schemas.openxmlformats.org/package/2006/relationships/digital-signature/origin", "/s", ""),
        ("http://schemas.microsoft.com/3dmanufacturing/2019/04/keystore", "/Secure/keystore.xml", ""),
    ];
    let bytes = package(&root, &parts);
    assert!(opened(&bytes, |package, _| Ok(package.signed)).unwrap());
    assert!(opened(&bytes, |package, context| package.spooled("3D/x.model", context)).is_ok());
    assert!(reason(opened(&bytes, |package, context| package.spooled("3D/secret.model", context))).contains("encrypted"));
}
