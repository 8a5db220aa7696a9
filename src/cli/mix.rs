use super::out::say;
use super::output::{Overwrite, PictureFiles};
use super::preview_args::{PreviewArgs, Settled};
use crate::atlas::Atlas;
use crate::error::{Error, Result};
use crate::film::{Compression, Image, Layer, Preview, WrittenLayer, judge};
use crate::scene::Illumination;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Args)]
pub struct MixArgs {
    /// An EXR file that `halflight render --atlas` wrote.
    atlas: PathBuf,

    /// The point of the square: S,T (S inter-reflection, T shadowlessness, both 0…1) or global, local, shadowless,
    /// one-bounce.
    #[arg(long, value_name = "S,T|NAME")]
    at: String,

    /// The picture: .exr has its standard error too, and a PNG preview beside it; .png and .jpg hold what a display shows, .pfm and
    /// .hdr linear light; - is an EXR file to standard output.
    #[arg(short, long, value_name = "FILE", default_value = "mix.exr")]
    output: PathBuf,

    #[command(flatten)]
    overwrite: Overwrite,

    #[command(flatten)]
    preview: PreviewArgs,

    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

/// Where the atlas leaves out more than this share of the light, users are told.
const TOLD: f64 = 1e-3;

pub fn run(args: &MixArgs) -> Result<ExitCode> {
    let (s, t) = point(&args.at)?;
    let files = PictureFiles::of(&args.output)?;
    files.claim(std::slice::from_ref(&args.atlas), args.overwrite, args.quiet)?;
    let (atlas, mut header) = Atlas::read(&args.atlas)?;
    let mixed = atlas.mix(s, t)?;
    header.entries.retain(|(name, _)| !name.starts_with("atlas_"));
    header.set("illumination", Illumination::Square { s: s as f32, t: t as f32 }.describe());
    header.set("mixed_from", args.atlas.display().to_string());
    header.set("left_out", mixed.left_out);
    header.set("error_samples", atlas.groups);
    if mixed.left_out > TOLD && !args.quiet {
        say(format_args!(
            "warning: light of more than {} reflections, about {:.1} % of all at this point, is not in the atlas; \
             `halflight render --illumination {}` has all of it",
            atlas.n.last(),
            100.0 * mixed.left_out,
            args.at
        ));
    }
    let size = (atlas.width, atlas.height);
    files.check_size(size)?;
    let shown = Settled::of(args.preview.over(Preview::default()), &mixed.visible);
    shown.tell(&mut header);
    files.show(size, &mixed.visible, shown.fixed())?;
    let warnings = judge(&mixed.visible, shown.preview.view, shown.stops).warnings(shown.stops);
    let layers = vec![
        (Layer::Visible.name().to_owned(), mixed.visible),
        (Layer::Error.name().to_owned(), mixed.error),
    ];
    let image = Image { width: atlas.width, height: atlas.height, layers, header };
    let layers: Vec<_> = WrittenLayer::all_of(&image).collect();
    files.put_layers(size, &image.header, &layers, Compression::PIZ)?;
    if !args.quiet {
        warnings.iter().for_each(|warning| say(format_args!("warning: {warning}")));
        shown.note().iter().for_each(say);
        say(format_args!("wrote {}", files.describe()));
    }
    Ok(ExitCode::SUCCESS)
}

fn point(text: &str) -> Result<(f64, f64)> {
    match text.parse::<Illumination>() {
        // In decimal: 0.7 is not to become 0.699999988.
        Ok(Illumination::Square { s, t }) => {
            let exact = |x: f32| x.to_string().parse().unwrap_or_else(|_| f64::from(x));
            Ok((exact(s), exact(t)))
        }
        _ => Err(Error::Usage(format!(
            "--at {text}: no point of the square; write S,T with both in 0…1, or global, local, shadowless, one-bounce"
        ))),
    }
}
