//! Pieces of Markdown that the sections of the page have in common.

use std::borrow::Borrow;

use super::statistics::Spread;

/// A line of a table.
pub(super) fn row<S: Borrow<str>>(columns: &[S]) -> String {
    format!("| {} |\n", columns.join(" | "))
}

/// The text, or a dash where there is none.
pub(super) fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "–".into())
}

/// Text that is shown when its summary is clicked.
pub(super) fn folded(summary: &str, text: &str) -> String {
    format!("\n<details><summary>{summary}</summary>\n\n{text}\n</details>\n")
}

/// The mean of shares, and the worst of them in brackets.
pub(super) fn mean_and_worst(shares: Vec<f64>, worst: fn(Spread) -> f64) -> String {
    let mean = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
    or_dash(Spread::of(shares).map(|spread| format!("{:.3} % ({:.2} %)", 100.0 * mean, 100.0 * worst(spread))))
}
