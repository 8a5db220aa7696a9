use super::out::say;
use super::output::{Overwrite, claim, ending};
use crate::atlas::Atlas;
use crate::error::{Error, Result};
use crate::film::replace_file;
use crate::report::square_page;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Args)]
pub struct ViewArgs {
    /// An EXR file that `halflight render --atlas` wrote.
    atlas: PathBuf,

    /// The page: one file that needs no network.
    #[arg(short, long, value_name = "FILE.html", default_value = "square.html")]
    output: PathBuf,

    #[command(flatten)]
    overwrite: Overwrite,

    /// The most that the page may take, in megabytes; the picture is halved until it fits.
    #[arg(long, value_name = "MB", default_value_t = 12.0)]
    megabytes: f64,

    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

pub fn run(args: &ViewArgs) -> Result<ExitCode> {
    if args.megabytes.is_nan() || args.megabytes <= 0.0 {
        return Err(Error::Usage(format!("--megabytes {}: give a size above zero", args.megabytes)));
    }
    if !["html", "htm"].contains(&ending(&args.output).as_str()) {
        return Err(Error::Usage(format!(
            "{}: the page is an HTML file; give it a name that ends in .html",
            args.output.display()
        )));
    }
    claim(&args.output, std::slice::from_ref(&args.atlas), args.overwrite)?;
    let (atlas, header) = Atlas::read(&args.atlas)?;
    let page = square_page(&atlas, &header, (1e6 * args.megabytes) as usize)
        .map_err(|e| Error::Write { path: args.output.clone(), reason: e.to_string() })?;
    replace_file(&args.output, |file| file.write_all(page.html.as_bytes()))?;
    if !args.quiet {
        let smaller = if page.halvings > 0 {
            format!(
                "; the picture is {} times smaller than the atlas, --megabytes allows more",
                1 << page.halvings
            )
        } else {
            String::new()
        };
        say(format_args!(
            "wrote {}: {:.1} MB, {} components, {:.2} % from the atlas{smaller}",
            args.output.display(),
            1e-6 * page.html.len() as f64,
            page.components,
            100.0 * page.off
        ));
    }
    Ok(ExitCode::SUCCESS)
}
