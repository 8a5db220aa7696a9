use super::denoise_args::DenoiseArgs;
use super::out::print;
use super::scene_args::SceneArgs;
use super::settings_args::SettingsArgs;
use crate::atlas;
use crate::error::Result;
use crate::existence::Existence;
use crate::film::Layer;
use crate::machine;
use crate::memory::words as bytes;
use crate::plan::{Frame, Plan};
use crate::render::{Forecast, Saving, savings};
use crate::scene::{Luminaire, Scene};
use clap::Args;
use serde_json::{Value, json};
use std::process::ExitCode;

#[derive(Args)]
pub struct PlanArgs {
    #[command(flatten)]
    scene: SceneArgs,

    #[command(flatten)]
    settings: SettingsArgs,

    /// Also what the atlas of the illumination square would take, as `halflight render --atlas` makes it.
    #[arg(long)]
    atlas: bool,

    /// Also the memory of mattes, as `halflight render --cryptomatte` makes them.
    #[arg(long)]
    cryptomatte: bool,

    #[command(flatten)]
    denoise: DenoiseArgs,

    /// Print it as JSON, for programs.
    #[arg(long)]
    json: bool,
}

/// Below this share of a pass two timings are not told apart.
const TOLD_APART: f64 = 0.05;

pub fn run(args: &PlanArgs) -> Result<ExitCode> {
    let (settings, asked) = args.settings.resolve()?;
    let layers = args.denoise.layers(&asked, settings.method, args.atlas)?;
    let mut scene = args.scene.load()?;
    let settings = args.settings.film(settings, &mut scene);
    let (plan, frame, mut forecast) = Forecast::make(scene.clone(), settings.clone(), &layers);
    let savings = savings(&scene, &plan, &frame, &forecast, &layers);
    if args.atlas {
        forecast.memory = atlas::forecast(&scene, settings, &layers)?;
    }
    if args.cryptomatte {
        forecast.memory = forecast.memory.with_mattes((plan.settings.width, plan.settings.height));
    }
    if args.denoise.denoise {
        forecast.memory = forecast.memory.with_denoising((plan.settings.width, plan.settings.height));
    }
    let savings = savings.as_deref();
    if args.json {
        print(&format!("{:#}\n", as_json(&scene, (&plan, &frame), &forecast, savings, &layers)))?;
    } else {
        let notes: String = scene.notes.iter().map(|note| format!("note: {note}\n")).collect();
        print(&(as_text(&scene, (&plan, &frame), &forecast, savings) + &notes))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn as_text(
    scene: &Scene,
    (plan, frame): (&Plan, &Frame),
    forecast: &Forecast,
    savings: Option<&[Saving]>,
) -> String {
    let mut text = format!("{}\nscene: {}\n", frame.one_line(plan), facts(scene));
    text.push_str(&format!("multiplication factor: {}\n", plan.existence.describe()));
    text.extend(plan.existence.refusal(&plan.scene).map(|refusal| format!("{refusal}\n")));
    text.extend(plan.existence.warning().map(|warning| format!("warning: {warning}\n")));
    for technique in frame.techniques(plan) {
        text.push_str(&format!("{}: {}, {}\n", technique.paths, technique.by, technique.because));
    }
    for (i, omission) in plan.omissions.iter().enumerate() {
        let saved = savings.map_or("a pass takes too long to try what it saves".into(), |all| saved(&all[i]));
        text.push_str(&format!("left out {}: {} ({saved})\n", omission.name, omission.reason));
    }
    let memory = forecast.memory;
    let named = |name: &str, held: usize| match held {
        0 => String::new(),
        held => format!("{name} {}, ", bytes(held as f64)),
    };
    let [textures, atlas, mattes] =
        [("textures", memory.textures), ("atlas", memory.atlas), ("mattes", memory.mattes)]
            .map(|(name, held)| named(name, held));
    text.push_str(&format!(
        "memory: about {} (planning {}; scene {}, {textures}index {}, film {}, {atlas}{mattes}photons {}, pass {}, writing {})\n",
        bytes(memory.total() as f64),
        bytes(memory.planning as f64),
        bytes(memory.scene as f64),
        bytes(memory.index as f64),
        bytes(memory.film as f64),
        bytes(memory.photons as f64),
        bytes(memory.pass as f64),
        bytes(memory.writing as f64),
    ));
    text.extend(memory.refusal(machine::memory()).map(|refusal| format!("refused: {refusal}\n")));
    let pass = forecast.pass;
    let share = |part: f64| (100.0 * part / pass.total()).round();
    if pass.total() > 0.0 {
        text.push_str(&format!(
            "time: {} of a processor for planning, then about {} a pass (shooting {} %, maps {} %, gathering {} %); passes \
             run on {} threads\n",
            seconds(forecast.planning),
            seconds(pass.total()),
            share(pass.shoot),
            share(pass.maps),
            share(pass.gather),
            rayon::current_num_threads(),
        ));
    }
    text
}

fn as_json(
    scene: &Scene,
    (plan, frame): (&Plan, &Frame),
    forecast: &Forecast,
    savings: Option<&[Saving]>,
    layers: &[Layer],
) -> Value {
    let techniques: Vec<Value> = frame
        .techniques(plan)
        .iter()
        .map(|t| json!({ "paths": t.paths, "by": t.by, "because": t.because }))
        .collect();
    let photons = frame.photons.as_ref().map(|photons| {
        json!({
            "paths": photons.paths,
            "direct": photons.classes.direct,
            "caustic": photons.classes.caustic,
            "indirect": photons.classes.indirect,
            "both_halves": photons.both_halves,
            "kept": photons.keep,
        })
    });
    let settings = &plan.settings;
    let memory = forecast.memory;
    json!({
        "scene": {
            "name": scene.name,
            "hash": format!("{:016x}", plan.scene_hash),
            "triangles": scene.mesh.triangles.len(),
            "triangles_rendered": plan.scene.mesh.triangles.len(),
            "materials": scene.materials.len(),
            "luminaires": scene.luminaires.len(),
            "illumination": scene.describe_illumination(),
            "notes": scene.notes,
        },
        "size": [settings.width, settings.height],
        "layers": layers.iter().map(|layer| layer.name()).collect::<Vec<_>>(),
        "method": settings.method.name(),
        "seed": settings.seed,
        "max_reflections": settings.max_reflections,
        "multiplication_factor": existence_as_json(&plan.existence),
        "photons": photons,
        "techniques": techniques,
        "omissions": omissions_as_json(plan, savings),
        "memory_bytes": {
            "total": memory.total(), "scene": memory.scene, "textures": memory.textures, "index": memory.index, "film": memory.film, "atlas": memory.atlas, "mattes": memory.mattes, "writing": memory.writing,
            "photons": memory.photons, "pass": memory.pass, "planning": memory.planning,
            "limit": machine::memory().map(|limit| limit.bytes),
        },
        "processor_seconds": seconds_as_json(forecast),
    })
}

/// The multiplication factor, and whether there is an image.
pub(super) fn existence_as_json(existence: &Existence) -> Value {
    match existence {
        Existence::Certain { at_most, .. } => json!({ "at_most": at_most }),
        Existence::Measured(m) => {
            json!({ "k": m.k, "error": m.error, "image_exists": !existence.is_refuted() })
        }
    }
}

fn seconds_as_json(forecast: &Forecast) -> Value {
    let pass = forecast.pass;
    json!({
        "planning": forecast.planning, "pass": pass.total(), "shoot": pass.shoot, "maps": pass.maps,
        "gather": pass.gather, "threads": rayon::current_num_threads(),
    })
}

fn omissions_as_json(plan: &Plan, savings: Option<&[Saving]>) -> Vec<Value> {
    plan.omissions
        .iter()
        .enumerate()
        .map(|(i, omission)| {
            let saves = savings.map(|all| &all[i]).map(|saving| {
                json!({
                    "pass_share": saving.pass, "planning_seconds": saving.planning, "bytes": saving.bytes,
                })
            });
            json!({ "name": omission.name, "reason": omission.reason, "saves": saves })
        })
        .collect()
}

fn facts(scene: &Scene) -> String {
    let smooth = scene.surfaces.iter().filter(|surface| surface.smooth).count();
    let punctual = scene.luminaires.iter().filter(|luminaire| luminaire.is_delta()).count();
    let around =
        scene.environment.as_ref().map_or(String::new(), |sky| format!(", environment {}", sky.name()));
    let suns = scene.skies.iter().filter(|sky| matches!(sky, Luminaire::Sun { .. })).count();
    let suns = if suns == 0 { String::new() } else { format!(", {suns} suns") };
    let mut before = None;
    let shining = scene.luminaires.iter().filter(|l| matches!(l, Luminaire::Triangle { .. }));
    let triangles = shining.filter(|luminaire| !luminaire.goes_on(before.replace(*luminaire))).count();
    format!(
        "{} triangles in {} surfaces ({smooth} smooth), {} materials, {} emissive triangles, {punctual} punctual lights{suns}{around}",
        scene.mesh.triangles.len(),
        scene.surfaces.len(),
        scene.materials.len(),
        triangles,
    )
}

/// What an omission saves, in words.
fn saved(saving: &Saving) -> String {
    let mut words = Vec::new();
    if saving.pass > TOLD_APART {
        words.push(format!("a pass with it takes {:.2} times as long", 1.0 + saving.pass));
    }
    if saving.planning > 0.01 {
        words.push(format!("{} of planning", seconds(saving.planning)));
    }
    if saving.bytes > 0 {
        words.push(bytes(saving.bytes as f64));
    }
    if words.is_empty() {
        "saves nothing that could be measured here".into()
    } else {
        format!("saves: {}", words.join(", "))
    }
}

fn seconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", 1e3 * seconds) } else { format!("{seconds:.1} s") }
}
