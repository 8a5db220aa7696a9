use super::scene_args::SceneArgs;
use crate::error::Result;
use crate::plan::{Plan, Settings};
use clap::Args;
use std::process::ExitCode;

#[derive(Args)]
pub struct PlanArgs {
    #[command(flatten)]
    scene: SceneArgs,
}

pub fn run(args: &PlanArgs) -> Result<ExitCode> {
    let scene = args.scene.load()?;
    let notes = scene.notes.clone();
    let plan = Plan::new(scene, Settings::default());
    print!("{}", plan.describe());
    for note in notes {
        println!("note: {note}");
    }
    Ok(ExitCode::SUCCESS)
}
