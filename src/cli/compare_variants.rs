//! Who competes in `halflight compare`: methods, or sets of options under names.

use super::compare_args::CompareArgs;
use super::denoise_args::DenoiseArgs;
use super::settings_args::{DEFAULT_LAYERS, SettingsArgs};
use crate::compare::Variant;
use crate::error::{Error, Result};
use crate::plan::{Method, Settings};
use clap::Parser;

/// The options of a variant, read as `halflight render` reads them.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Options {
    #[command(flatten)]
    settings: SettingsArgs,

    #[command(flatten)]
    denoise: DenoiseArgs,
}

/// Who competes, in the order in which they are named.
///
/// # Errors
/// A name that is not there, is there twice, or cannot stand in a page; what an option says; methods and variants together.
pub fn variants(args: &CompareArgs) -> Result<Vec<Variant>> {
    let base = args.settings();
    let sets: Vec<_> = args.option_sets().collect();
    if args.variant.len() > sets.len() + 1 {
        return Err(Error::Usage(
            "--variant names several variants of the scene's materials; compare one at a time, and write options as in \
             --variant 'wide: --indirect-radius 24'"
                .into(),
        ));
    }
    if sets.is_empty() {
        return methods(args, &base);
    }
    if !args.methods.is_empty() {
        return Err(Error::Usage(
            "--methods and --variant both say who competes; write methods as variants, as in --variant 'path: --method path'".into(),
        ));
    }
    let all: Vec<_> =
        sets.iter().map(|(name, options)| variant(name, options, &base)).collect::<Result<_>>()?;
    match twice(&all) {
        Some(name) => Err(Error::Usage(format!("--variant names {name} twice; give each a name of its own"))),
        None => Ok(all),
    }
}

fn methods(args: &CompareArgs, base: &Settings) -> Result<Vec<Variant>> {
    let named = args.methods.iter().map(|name| method("--methods", name)).collect::<Result<Vec<_>>>()?;
    let methods = if named.is_empty() { Method::ALL.to_vec() } else { named };
    if let (Some(samples), true) = (args.samples, methods.iter().all(|m| m.shoots())) {
        return Err(Error::Usage(format!(
            "--samples {samples}: photons take one camera sample per pixel and pass; add path to --methods"
        )));
    }
    let all: Vec<_> = methods.iter().map(|method| Variant::of(*method, base)).collect();
    match twice(&all) {
        Some(name) => Err(Error::Usage(format!("--methods names {name} twice; name each once"))),
        None => Ok(all),
    }
}

/// A method by its name; `option` is for messages.
pub fn method(option: &str, name: &str) -> Result<Method> {
    Method::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| {
        let known = Method::ALL.map(Method::name).join(", ");
        Error::Usage(format!("{option}: there is no method '{name}'; the methods are {known}"))
    })
}

fn twice(all: &[Variant]) -> Option<&str> {
    let mut names = all.iter().enumerate().map(|(i, variant)| (i, variant.name.as_str()));
    names.find(|(i, name)| all[..*i].iter().any(|earlier| earlier.name == *name)).map(|(_, name)| name)
}

fn variant(name: &str, options: &str, base: &Settings) -> Result<Variant> {
    let wrong = |why: String| Error::Usage(format!("--variant '{name}: {options}': {why}"));
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.+".contains(c);
    if name.is_empty() || name == "reference" || !name.chars().all(plain) {
        return Err(wrong("a name has letters, digits and - _ . + (and is not reference)".into()));
    }
    let read =
        Options::try_parse_from(options.split_whitespace()).map_err(|error| wrong(first_line(&error)))?;
    let SettingsArgs { size, layers, max_reflections, seed, samples, indirect_radius, .. } = &read.settings;
    let common = [
        ("--size", size.is_some()),
        ("--layers", *layers != [DEFAULT_LAYERS[0], DEFAULT_LAYERS[1]]),
        ("--max-reflections", max_reflections.is_some()),
        ("--seed", *seed != 0),
    ];
    if let Some((option, _)) = common.iter().find(|(_, given)| *given) {
        return Err(wrong(format!("{option} is the same for all that are compared; leave it out here")));
    }
    let (settings, layers) = read.settings.resolve().map_err(|error| wrong(error.to_string()))?;
    read.denoise.layers(&layers, settings.method, false).map_err(|error| wrong(error.to_string()))?;
    let usual = match settings.paths {
        Some(paths) => Settings::for_film(base.width, base.height).with_paths(paths),
        None => base.clone(),
    };
    let settings = Settings {
        width: base.width,
        height: base.height,
        paths: settings.paths.or(base.paths),
        samples: samples.unwrap_or(base.samples),
        max_reflections: base.max_reflections,
        indirect_radius: indirect_radius.unwrap_or(usual.indirect_radius),
        ..settings
    };
    Ok(Variant { name: name.into(), settings, denoise: read.denoise.denoise })
}

/// What the reader of options says, in a line.
fn first_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    format!("{}; `halflight render --help` lists what there is", line.trim_start_matches("error: "))
}
