//! The documents list every setting and every repair.

#![allow(clippy::unwrap_used)]

use suture_core::{Profile, RepairName};

/// The first column of a page's tables: names in backticks.
fn listed(page: &str) -> Vec<&str> {
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.flat_map(|row| row.split(" |").next().into_iter().flat_map(|cell| cell.split('`').step_by(2))).collect()
}

#[test]
fn the_readme_describes_every_setting_of_a_profile() {
    let listed = listed(include_str!("../../README.md"));
    let profile = serde_json::to_value(Profile::default()).unwrap();
    let forgotten: Vec<_> =
        profile.as_object().unwrap().keys().filter(|name| *name != "name" && !listed.contains(&name.as_str())).collect();
    assert!(forgotten.is_empty(), "README.md lacks {forgotten:?}");
}

#[test]
fn the_description_of_the_report_has_every_repair() {
    let listed = listed(include_str!("../REPORT.md"));
    let forgotten: Vec<_> = RepairName::ALL.iter().map(|name| name.as_str()).filter(|name| !listed.contains(name)).collect();
    assert!(forgotten.is_empty(), "REPORT.md lacks {forgotten:?}");
}
