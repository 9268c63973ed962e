//! A job template of Open Job Description (`jobtemplate-2023-09` with the extension `TASK_CHUNKING`) for schedulers such as AWS Deadline Cloud: a check,
//! snapshots, chunks of frames, and a last step, each after the one before it. There is no plan: whoever submits the template may choose other frames, sizes
//! and paths, and they are passed to its commands.

use std::{fmt::Write, path::Path};

use bansho::media::files::provenance::COMMENT_LINE;
use serde_json::Value;

use super::{
    error::FarmError,
    products::Products,
    task::{NO_MORE_SNAPSHOTS, check_printable, requested_memory_mib, script_path},
};

/// Revision of the specification.
const SPECIFICATION: &str = "jobtemplate-2023-09";
/// Longest name of a job that the specification allows, characters.
const MAX_NAME: usize = 128;

/// What a template is made of. The values are the defaults of its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct TemplateOptions {
    /// Name of the job.
    pub name: String,
    /// The scene, relative to the folder of the template; `None` if it is outside of it, so that the parameter has no default.
    pub scene: Option<String>,
    /// Name of the frames, such as `fire.####.exr`.
    pub frame_name: String,
    /// The frames, in the syntax of frame lists.
    pub frames: String,
    /// Width and height, pixels.
    pub size: [usize; 2],
    /// Frames of a chunk.
    pub chunk_frames: u64,
    /// Target time of a chunk, s, by which schedulers adapt the number of frames.
    pub task_s: u64,
    /// Columns and rows of tiles of a picture.
    pub tiles: [usize; 2],
    /// Whether chunks begin with snapshots.
    pub snapshots: bool,
    /// Further options of `bansho render`.
    pub options: Vec<String>,
    /// What is made at the end; relative paths are those of the folder of the frames.
    pub products: Products,
    /// A random token, which the first step writes to the folder of the frames.
    pub token: String,
    /// The program and its version.
    pub program: String,
    /// Digest of the arithmetic of this machine.
    pub arithmetic: String,
    /// Estimated peak memory of a chunk, bytes.
    pub memory_bytes: f64,
    /// Estimated peak memory of the last step, bytes.
    pub finish_memory_bytes: f64,
}

/// The option that names the frames.
const OUT: &str = "--out={{Param.OutputFolder}}/{{Param.FrameName}}";
/// The option of all frames of the shot.
const ALL_FRAMES: &str = "--frames={{Param.Frames}}";
/// The option of the folder of snapshots.
const STATES: &str = "--snapshots={{Param.OutputFolder}}/states";

/// `text` as a string of YAML: every string of JSON is one.
fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// `text` as a string without expressions.
fn literal(text: &str) -> Result<String, FarmError> {
    if text.contains("{{") || text.contains("}}") {
        return Err(FarmError::Braces { text: text.to_owned() });
    }
    check_printable(text)?;
    Ok(quoted(text))
}

struct Template {
    text: String,
}

/// A step of the job.
struct Step<'a> {
    name: &'a str,
    /// The steps that it waits for. All whose files it reads: where machines share no folder, schedulers bring the files of these steps alone.
    after: &'a [&'a str],
    memory_bytes: f64,
    /// Its tasks, where there are many.
    space: &'a str,
    /// What each machine runs before its first task.
    environment: &'a str,
    arguments: &'a [String],
}

impl Template {
    fn parameter(&mut self, name: &str, kind: &str, description: &str, default: Option<String>) {
        // Writing to a string cannot fail.
        let _ = write!(self.text, "  - name: {name}\n    type: {kind}\n    description: {}\n", quoted(description));
        if let Some(default) = default {
            let _ = writeln!(self.text, "    default: {default}");
        }
    }

    /// A folder or a file, which schedulers map to the paths of their machines.
    fn path(&mut self, name: &str, object: &str, flow: &str, description: &str, default: Option<String>) {
        self.parameter(name, "PATH", description, default);
        let _ = write!(self.text, "    objectType: {object}\n    dataFlow: {flow}\n");
    }

    fn step(&mut self, step: &Step<'_>) {
        let _ = writeln!(self.text, "  - name: {}", step.name);
        for (index, after) in step.after.iter().enumerate() {
            let key = if index == 0 { "    dependencies:\n" } else { "" };
            let _ = writeln!(self.text, "{key}      - dependsOn: {after}");
        }
        let _ = write!(
            self.text,
            "    hostRequirements:\n      amounts:\n        - name: amount.worker.memory\n          min: {}\n{}{}    script:\n      actions:\n        onRun:\n",
            requested_memory_mib(step.memory_bytes),
            step.space,
            step.environment,
        );
        self.text += &action("          ", step.arguments);
        // A clean stop, with the frames so far kept.
        self.text +=
            "          cancelation:\n            mode: NOTIFY_THEN_TERMINATE\n            notifyPeriodInSeconds: 30\n";
    }
}

/// A command of the program, indented by `indent`.
fn action(indent: &str, arguments: &[String]) -> String {
    let mut text = format!("{indent}command: \"{{{{Param.Program}}}}\"\n{indent}args:\n");
    for argument in arguments {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{indent}  - {argument}");
    }
    text
}

/// The text of the template, YAML.
///
/// # Errors
/// A name or an option has `{{` or `}}`, which Open Job Description takes for an expression, or a control character.
pub fn template(options: &TemplateOptions) -> Result<String, FarmError> {
    let name: String = options.name.chars().take(MAX_NAME).collect();
    let text = format!(
        "{COMMENT_LINE}specificationVersion: {SPECIFICATION}\nextensions: [TASK_CHUNKING]\nname: {}\nparameterDefinitions:\n",
        literal(&name)?
    );
    let mut template = Template { text };
    parameters(&mut template, options)?;
    template.text += "steps:\n";
    steps(&mut template, options)?;
    Ok(template.text)
}

fn parameters(template: &mut Template, options: &TemplateOptions) -> Result<(), FarmError> {
    let scene = options.scene.as_deref().map(literal).transpose()?;
    template.path("SceneFile", "FILE", "IN", "The scene.", scene);
    template.path("OutputFolder", "DIRECTORY", "OUT", "The folder of the frames.", Some(quoted("out")));
    let [width, height] = options.size;
    for (name, description, default) in [
        ("FrameName", "Name of the frames; #### is replaced by the number.", literal(&options.frame_name)?),
        ("Frames", "Frames: 0-239, 0-239:10, 1-5,9.", literal(&options.frames)?),
        ("Size", "Width and height of the picture.", quoted(&format!("{width}x{height}"))),
        ("Program", "The program on the machines.", quoted("bansho")),
    ] {
        template.parameter(name, "STRING", description, Some(default));
    }
    template.parameter("ChunkFrames", "INT", "Frames of a chunk.", Some(options.chunk_frames.to_string()));
    template.text += "    minValue: 1\n";
    Ok(())
}

fn steps(template: &mut Template, options: &TemplateOptions) -> Result<(), FarmError> {
    let check = check_arguments(options)?;
    let environment = format!(
        "    stepEnvironments:\n      - name: Machine\n        description: \"Checks that this machine sees the same folder and draws the same bytes.\"\n        \
         script:\n          actions:\n            onEnter:\n{}",
        action("              ", &check)
    );
    let memory_bytes = options.memory_bytes;
    let leave: Vec<String> = check.iter().cloned().chain([quoted("--leave-token")]).collect();
    let step = Step { name: "Check", after: &[], memory_bytes, space: "", environment: "", arguments: &leave };
    template.step(&step);
    let step = Step { environment: &environment, ..step };
    if options.snapshots {
        let arguments = &snapshots_command(options)?;
        template.step(&Step { name: "Snapshots", after: &["Check"], arguments, ..step });
    }
    let after: &[&str] = if options.snapshots { &["Check", "Snapshots"] } else { &["Check"] };
    let (space, arguments) = (&parameter_space(options), &frames_command(options)?);
    template.step(&Step { name: "Frames", after, space, arguments, ..step });
    let (arguments, memory_bytes) = (&finish_command(options)?, options.finish_memory_bytes);
    template.step(&Step { name: "Finish", after: &["Check", "Frames"], memory_bytes, arguments, ..step });
    Ok(())
}

/// A command on the frames of the shot, with `more` options.
fn command(options: &TemplateOptions, words: &[&str], more: Vec<String>) -> Result<Vec<String>, FarmError> {
    let shared = [OUT, "--size={{Param.Size}}"];
    let all = words.iter().chain(&shared).map(|word| quoted(word)).chain(more.iter().map(|word| quoted(word)));
    let extra = options.options.iter().map(|option| literal(option)).collect::<Result<Vec<_>, _>>()?;
    Ok(all.chain(extra).chain(["--", "{{Param.SceneFile}}"].map(quoted)).collect())
}

fn tiles_option(options: &TemplateOptions) -> Option<String> {
    let [columns, rows] = options.tiles;
    (options.tiles != [1, 1]).then(|| format!("--tiles={columns}x{rows}"))
}

fn snapshots_command(options: &TemplateOptions) -> Result<Vec<String>, FarmError> {
    let more = [ALL_FRAMES, STATES, "--chunk={{Param.ChunkFrames}}"].map(str::to_owned);
    command(options, &["farm", "snapshots"], more.into_iter().chain(tiles_option(options)).collect())
}

fn frames_command(options: &TemplateOptions) -> Result<Vec<String>, FarmError> {
    let mut more = vec!["--frames={{Task.Param.Frame}}".to_owned(), "--resume".to_owned()];
    if options.snapshots {
        more.extend([STATES.to_owned(), format!("--snapshot-every={NO_MORE_SNAPSHOTS}")]);
    }
    let Some(tiles) = tiles_option(options) else { return command(options, &["render"], more) };
    more.extend([tiles, "--tile={{Task.Param.Tile}}".to_owned()]);
    command(options, &["farm", "tile"], more)
}

fn finish_command(options: &TemplateOptions) -> Result<Vec<String>, FarmError> {
    let more = [ALL_FRAMES.to_owned()].into_iter().chain(tiles_option(options));
    command(options, &["farm", "finish"], more.chain(product_arguments(&options.products)?).collect())
}

/// The tasks of the step that draws: chunks of frames, and each tile of them.
fn parameter_space(options: &TemplateOptions) -> String {
    let mut space = format!(
        "    parameterSpace:\n      taskParameterDefinitions:\n        - name: Frame\n          type: CHUNK[INT]\n          range: \"{{{{Param.Frames}}}}\"\n          \
         chunks:\n            defaultTaskCount: \"{{{{Param.ChunkFrames}}}}\"\n            targetRuntimeSeconds: {}\n            rangeConstraint: CONTIGUOUS\n",
        options.task_s
    );
    if options.tiles != [1, 1] {
        let last = options.tiles[0] * options.tiles[1] - 1;
        let _ = write!(
            space,
            "        - name: Tile\n          type: INT\n          range: \"0-{last}\"\n      combination: \"Frame * Tile\"\n"
        );
    }
    space
}

/// What checks a machine.
fn check_arguments(options: &TemplateOptions) -> Result<Vec<String>, FarmError> {
    let words = ["farm", "check", OUT].map(quoted);
    let expected = [("token", &options.token), ("made-by", &options.program), ("arithmetic", &options.arithmetic)];
    let expected = expected.map(|(name, value)| literal(&format!("--{name}={value}")));
    words.into_iter().map(Ok).chain(expected).collect()
}

/// What the last step is asked to make.
fn product_arguments(products: &Products) -> Result<Vec<String>, FarmError> {
    let mut arguments = Vec::new();
    if let Some(film) = &products.film {
        arguments.push(format!("--film={}", in_output_folder(film)?));
    }
    arguments.extend(products.contact_sheet.map(|count| format!("--contact-sheet={count}")));
    if let Some(flipbook) = &products.flipbook {
        let ([columns, rows], path) = (flipbook.grid, in_output_folder(&flipbook.path)?);
        arguments.extend([format!("--flipbook={path}"), format!("--flipbook-grid={columns}x{rows}")]);
        arguments.extend(flipbook.tile.map(|[width, height]| format!("--flipbook-size={width}x{height}")));
    }
    Ok(arguments)
}

/// `path` as seen from the folder of the frames.
fn in_output_folder(path: &Path) -> Result<String, FarmError> {
    let text = script_path(path)?;
    literal(&text)?;
    Ok(if path.is_absolute() { text } else { format!("{{{{Param.OutputFolder}}}}/{text}") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::products::FlipbookRequest;

    fn options() -> TemplateOptions {
        TemplateOptions {
            name: "wet street".into(),
            scene: Some("a \"b\".toml".into()),
            frame_name: "a.####.png".into(),
            frames: "0-59".into(),
            size: [96, 64],
            chunk_frames: 10,
            task_s: 1800,
            tiles: [1, 1],
            snapshots: true,
            options: vec!["--set=a.b=\"c\"".into()],
            products: Products { film: Some("a.apng".into()), ..Products::default() },
            token: "0123".into(),
            program: "Bansho 1".into(),
            arithmetic: "ab".into(),
            memory_bytes: 1e9,
            finish_memory_bytes: 2e9,
        }
    }

    #[test]
    fn the_steps_follow_each_other() {
        let text = template(&options()).unwrap();
        for lines in [
            "specificationVersion: jobtemplate-2023-09\nextensions: [TASK_CHUNKING]\nname: \"wet street\"\n",
            "    default: \"a \\\"b\\\".toml\"\n",
            "  - name: Snapshots\n    dependencies:\n      - dependsOn: Check\n",
            "  - name: Frames\n    dependencies:\n      - dependsOn: Check\n      - dependsOn: Snapshots\n    host",
            "  - name: Finish\n    dependencies:\n      - dependsOn: Check\n      - dependsOn: Frames\n    host",
            "          type: CHUNK[INT]\n          range: \"{{Param.Frames}}\"\n",
            "            - \"--set=a.b=\\\"c\\\"\"\n",
            "            - \"--film={{Param.OutputFolder}}/a.apng\"\n",
            "          min: 1687\n",
            "          min: 3118\n",
        ] {
            assert!(text.contains(lines), "{lines}\n{text}");
        }
        assert!(!text.contains("Tile") && !text.contains("tile"), "{text}");
        let products = Products::default();
        let alone = template(&TemplateOptions { snapshots: false, scene: None, products, ..options() }).unwrap();
        assert!(!alone.contains("Snapshot") && !alone.contains("states") && !alone.contains("--film"), "{alone}");
        assert!(alone.contains("  - name: Frames\n    dependencies:\n      - dependsOn: Check\n    host"), "{alone}");
    }

    #[test]
    fn each_machine_is_checked_before_it_draws() {
        let text = template(&options()).unwrap();
        assert_eq!(text.matches("name: Machine").count(), 3, "{text}");
        for argument in ["--token=0123", "--made-by=Bansho 1", "--arithmetic=ab"] {
            assert_eq!(text.matches(&format!("- \"{argument}\"\n")).count(), 4, "{text}");
        }
        let (check, others) = text.split_once("  - name: Snapshots\n").unwrap();
        assert!(check.contains("--leave-token") && !others.contains("--leave-token"), "{text}");
    }

    #[test]
    fn tiles_are_a_parameter_of_the_tasks() {
        let text = template(&TemplateOptions { tiles: [3, 2], ..options() }).unwrap();
        let lines = "        - name: Tile\n          type: INT\n          range: \"0-5\"\n      combination: \"Frame * Tile\"\n";
        assert!(text.contains(lines), "{text}");
        assert_eq!(text.matches("\"--tiles=3x2\"").count(), 3, "snapshots, frames and the last step: {text}");
        assert_eq!(text.matches("\"--tile={{Task.Param.Tile}}\"").count(), 1, "{text}");
    }

    #[test]
    fn products_are_beside_the_frames() {
        let flipbook = Some(FlipbookRequest { path: "game/a.png".into(), grid: [8, 4], tile: Some([64, 32]) });
        let products = Products { film: Some("/films/a.mp4".into()), contact_sheet: Some(9), flipbook };
        let text = template(&TemplateOptions { products, ..options() }).unwrap();
        for argument in [
            "--film=/films/a.mp4",
            "--contact-sheet=9",
            "--flipbook={{Param.OutputFolder}}/game/a.png",
            "--flipbook-grid=8x4",
            "--flipbook-size=64x32",
        ] {
            assert!(text.contains(&format!("            - \"{argument}\"\n")), "{argument}\n{text}");
        }
    }

    #[test]
    fn what_would_be_an_expression_is_refused() {
        let film = Products { film: Some("{{a}}.mp4".into()), ..Products::default() };
        for bad in [
            TemplateOptions { frame_name: "{{Param.Size}}.png".into(), ..options() },
            TemplateOptions { options: vec!["--set=a={{b}}".into()], ..options() },
            TemplateOptions { products: film, ..options() },
        ] {
            assert!(matches!(template(&bad), Err(FarmError::Braces { .. })));
        }
    }
}
