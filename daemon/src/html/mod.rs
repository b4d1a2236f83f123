//! Reports for a browser: one file, which needs no other and no network, and runs no script. Whatever a file's name or header says is text, never
//! markup.

pub(crate) mod command;
mod report;

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Reads well on a telephone, on paper, and in the dark.
const STYLE: &str = "\
:root{color-scheme:light dark;--line:#c9d1da;--soft:#f3f5f8;--good:#17693a;--review:#8a5200;--bad:#a3122b}\
@media(prefers-color-scheme:dark){:root{--line:#3d4651;--soft:#1e242b;--good:#5fd08d;--review:#f0b04f;--bad:#ff8095}}\
body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:0 auto;padding:1rem}\
h1{font-size:1.4rem;overflow-wrap:anywhere;margin:.5rem 0}h2{font-size:1.1rem;margin:1.6rem 0 .4rem}\
.outcome{border-left:.4rem solid;padding:.4rem .9rem;background:var(--soft)}\
.outcome strong{font-size:1.15rem}.good{border-color:var(--good)}.good strong{color:var(--good)}\
.review{border-color:var(--review)}.review strong{color:var(--review)}.bad{border-color:var(--bad)}.bad strong{color:var(--bad)}\
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid var(--line);vertical-align:top}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}\
img{max-width:100%;height:auto;background:#fff}figure{margin:1rem 0}figcaption{font-size:.9rem}\
code{overflow-wrap:anywhere}details{margin:.8rem 0}summary{cursor:pointer;font-weight:600}\
.key{display:inline-block;width:.9em;height:.9em;margin:0 .3em 0 .9em;border:1px solid #0006;vertical-align:-.1em}";

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
