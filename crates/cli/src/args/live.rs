//! The command line of the live view.

use std::path::Path;

use clap::Args;
use steradian::Result;
use steradian::internal::live::{DEFAULT_ADDRESS, Live, Options, PreviewOptions, TevOptions};
use steradian::internal::render::Settings;

/// The live viewers of a render.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Live view")]
pub struct LiveArgs {
    /// Send the picture with its layers to the viewer tev as it grows [default: 127.0.0.1:14158]
    ///
    /// tev may be started, stopped and restarted at any time; it gets the newest picture once it is connected. A slow
    /// viewer never stalls the render.
    #[
        arg(
            long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = DEFAULT_ADDRESS,
            value_parser = parse_address
        )
    ]
    pub tev: Option<String>,
    /// Serve a web page that shows the picture as it grows, at this port; 0 for any free port
    ///
    /// The address is printed to stderr. The page shows every layer, with exposure, views, zoom, the exact values of
    /// pixels and what is left to do. It is served to this machine alone unless --preview-bind is given.
    #[arg(long, value_name = "PORT")]
    pub preview: Option<u16>,
    /// Serve the page at this address of this machine, such as 0.0.0.0: everyone who reaches it sees the picture
    #[arg(long, value_name = "ADDR", requires = "preview")]
    pub preview_bind: Option<String>,
    /// Keep serving the page after the render, until Ctrl-C
    #[arg(long, requires = "preview")]
    pub preview_hold: bool,
}

impl LiveArgs {
    /// The viewers of a scene's picture.
    ///
    /// # Errors
    /// [`steradian::Error::Usage`] if the page cannot be served at the address and port.
    pub fn start(&self, scene: &Path, settings: &Settings) -> Result<Live> {
        let tev = self.tev.as_ref().map(|address| TevOptions { address: address.clone(), ..TevOptions::default() });
        let preview = self.preview.map(|port| {
            let host = self.preview_bind.clone().unwrap_or(PreviewOptions::default().host);
            PreviewOptions { host, port, view: settings.view(), ..PreviewOptions::default() }
        });
        let name = scene.file_stem().map_or_else(|| "picture".to_owned(), |stem| stem.to_string_lossy().into_owned());
        Live::new(Options { name, time_limit: settings.time_limit, tev, preview })
    }
}

fn parse_address(text: &str) -> Result<String, String> {
    let port =
        text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).and_then(|(_, port)| port.parse::<u16>().ok());
    match port {
        Some(1..) => Ok(text.to_owned()),
        _ => Err("expected HOST:PORT (put the scene before --tev)".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        live: LiveArgs,
    }

    fn parse(line: &str) -> Result<LiveArgs, clap::Error> {
        Line::try_parse_from(["render"].into_iter().chain(line.split_whitespace())).map(|line| line.live)
    }

    #[test]
    fn the_address_of_tev_may_be_left_out() {
        assert_eq!(parse("").unwrap().tev, None);
        assert_eq!(parse("--tev").unwrap().tev.as_deref(), Some(DEFAULT_ADDRESS));
        assert_eq!(parse("--tev --preview 0").unwrap().tev.as_deref(), Some(DEFAULT_ADDRESS));
        assert_eq!(parse("--tev [::1]:80").unwrap().tev.as_deref(), Some("[::1]:80"));
        for wrong in ["scene.json", "host", "host:", ":80", "host:0", "host:70000"] {
            assert!(parse(&format!("--tev {wrong}")).is_err(), "{wrong}");
        }
    }

    #[test]
    fn options_of_the_page_need_the_page() {
        let live = parse("--preview 0 --preview-bind 0.0.0.0 --preview-hold").unwrap();
        assert_eq!((live.preview, live.preview_bind.as_deref(), live.preview_hold), (Some(0), Some("0.0.0.0"), true));
        for wrong in ["--preview", "--preview 70000", "--preview-hold", "--preview-bind 0.0.0.0"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
