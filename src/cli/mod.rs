//! The command line: one file per command. What the user asked for becomes settings here, once.

mod check;
mod check_page;
mod compare;
mod compare_args;
mod compare_variants;
mod denoise_args;
pub mod diff;
#[cfg(test)]
mod diff_tests;
mod diff_text;
pub mod escape;
mod info;
mod interrupt;
mod keep;
mod limits;
mod live;
mod merge;
mod mix;
mod out;
mod output;
mod plan;
mod preview_args;
mod progress;
mod render;
mod scene_args;
mod settings_args;
mod threads;
mod under_way;
mod view;
mod watch;
mod writer;

use crate::error::{Error, Result};
use clap::error::{ContextKind, ContextValue};
use clap::{Parser, Subcommand};
use std::path::Path;
use std::process::ExitCode;

/// Renders scenes lit by vector-valued light, with caustics and an error bar.
#[derive(Parser)]
#[command(name = "halflight", version, about, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to an EXR file and a PNG preview.
    Render(Box<render::RenderArgs>),
    /// Add up the stored states of shards of one render.
    Merge(merge::MergeArgs),
    /// Say what a scene needs, what is left out and why.
    Plan(plan::PlanArgs),
    /// Say what is in a scene, as it was read: geometry, camera, materials and their matrices, lights and their power.
    Info(info::InfoArgs),
    /// Check numerical stability: a scene's, or a suite of stiff and extreme cases against closed forms.
    Check(check::CheckArgs),
    /// Make any picture of the illumination square from an atlas.
    Mix(mix::MixArgs),
    /// Make a page of an atlas in which one can walk about the illumination square.
    View(view::ViewArgs),
    /// Compare a picture with a reference: RMSE, relMSE, bias, e_pixel, mean colour, FLIP.
    Diff(diff::DiffArgs),
    /// Error against run time: methods, time budgets and seeds against a reference.
    Compare(Box<compare::CompareArgs>),
}

/// Parses the command line, runs one command, prints what went wrong as one line.
///
/// Exit codes: 0 done, 1 a limit of `diff` exceeded or a promise of `check` not kept, 2 what the user gave is wrong or what
/// was to be printed could not be, 3 no image exists, 85 ended before it was complete, with its state kept, 128 + n ended by signal n (130 Ctrl-C, 143 SIGTERM), with the
/// picture so far written.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors.
            if error.use_stderr() {
                match hint(&error) {
                    Some(hint) => out::say(format_args!("halflight: {hint}")),
                    None => drop(error.print()),
                }
                return ExitCode::from(2);
            }
            return match out::told(error.print()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => failed(&error),
            };
        }
    };
    match run(arguments.command) {
        Ok(code) => code,
        Err(error) => failed(&error),
    }
}

fn failed(error: &Error) -> ExitCode {
    out::say(format_args!("halflight: {error}"));
    ExitCode::from(error.exit_code())
}

/// Who gives a scene where a command is wanted means to render it.
fn hint(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    let path = Path::new(given);
    let is_scene = ["gltf", "glb"].contains(&output::ending(path).as_str());
    (is_scene || given.starts_with("builtin:") || path.exists())
        .then(|| format!("{given} is no command; to render a scene: halflight render {given}"))
}

fn run(command: Command) -> Result<ExitCode> {
    match command {
        Command::Render(args) => render::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Mix(args) => mix::run(&args),
        Command::View(args) => view::run(&args),
        Command::Compare(args) => compare::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Check(args) => check::run(args),
        Command::Diff(args) => Ok(match diff::run(&args)? {
            diff::Verdict::Within => ExitCode::SUCCESS,
            diff::Verdict::Exceeded => ExitCode::from(1),
        }),
    }
}
