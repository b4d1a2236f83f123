//! Log lines on standard error: for people on a terminal, JSON otherwise, or as `--log-format` says. `SUTURE_LOG` chooses what is said
//! (`debug`, `suture=debug,info`, …).

use std::io::IsTerminal;

use tracing_subscriber::EnvFilter;

use crate::cli::LogFormat;

/// Starts logging at `level` unless `SUTURE_LOG` says otherwise.
pub(crate) fn start(level: &str, format: LogFormat) {
    let filter = EnvFilter::try_from_env("SUTURE_LOG").unwrap_or_else(|_| EnvFilter::new(level));
    let terminal = std::io::stderr().is_terminal();
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(terminal);
    // A second start (only tests could make one) keeps the first.
    let _ = match format {
        LogFormat::Auto if !terminal => log.json().flatten_event(true).with_current_span(true).with_span_list(false).try_init(),
        LogFormat::Json => log.json().flatten_event(true).with_current_span(true).with_span_list(false).try_init(),
        LogFormat::Auto | LogFormat::Text => log.with_target(false).compact().try_init(),
    };
}
