//! Reports for a browser: one file, which needs no other and no network, and runs no script. Whatever a file's name or header says is text, never
//! markup.

pub(crate) mod command;
pub(crate) mod night;
pub(crate) mod report;
pub(crate) mod words;

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Reads well on a telephone, on paper, and in the dark.
pub(crate) const STYLE: &str = include_str!("../../assets/report.css");

/// A whole page.
fn page(title: &str, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (body) } }
        }
    }
}
