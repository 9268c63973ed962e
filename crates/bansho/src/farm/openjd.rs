//! A job template of Open Job Description (`jobtemplate-2023-09` with the extension `TASK_CHUNKING`) for schedulers such as AWS Deadline Cloud: snapshots,
//! chunks of frames, and a last step, each after the one before it. Its commands are plain ones of the program, so that whoever submits the template may
//! choose other frames, sizes and paths.

use std::fmt::Write;

use serde_json::Value;

use super::error::FarmError;

/// Revision of the specification.
const SPECIFICATION: &str = "jobtemplate-2023-09";
/// Longest name of a job that the specification allows, characters.
const MAX_NAME: usize = 128;
/// Snapshots at the beginning of chunks only: this interval is never reached after the first frame.
const NO_MORE_SNAPSHOTS: i64 = i64::MAX;
/// Factor from the estimated to the requested memory, and what is added to it, MiB.
const MEMORY_HEADROOM: (f64, f64) = (1.5, 256.0);

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
    /// Wanted time of a chunk, s, by which schedulers adapt the number of frames.
    pub task_s: u64,
    /// The first frame of the last chunk, where chunks begin with snapshots.
    pub snapshot_frame: Option<i64>,
    /// Further options of `bansho render`.
    pub options: Vec<String>,
    /// Name of the film that is made at the end, in the folder of the frames.
    pub film: Option<String>,
    /// Estimated peak memory of a chunk, bytes.
    pub memory_bytes: f64,
}

/// `text` as a string of YAML: every string of JSON is one.
fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// `text` as a string without expressions.
fn literal(text: &str) -> Result<String, FarmError> {
    if text.contains("{{") || text.contains("}}") {
        return Err(FarmError::Braces { text: text.to_owned() });
    }
    super::task::check_printable(text)?;
    Ok(quoted(text))
}

struct Template {
    text: String,
    memory_mib: u64,
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

    fn step(&mut self, name: &str, after: Option<&str>, space: &str, arguments: &[String]) {
        let _ = writeln!(self.text, "  - name: {name}");
        if let Some(after) = after {
            let _ = write!(self.text, "    dependencies:\n      - dependsOn: {after}\n");
        }
        let _ = write!(
            self.text,
            "    hostRequirements:\n      amounts:\n        - name: amount.worker.memory\n          min: {}\n{space}",
            self.memory_mib
        );
        self.text +=
            "    script:\n      actions:\n        onRun:\n          command: \"{{Param.Program}}\"\n          args:\n";
        for argument in arguments {
            let _ = writeln!(self.text, "            - {argument}");
        }
        // A clean stop, with the frames so far kept.
        self.text +=
            "          cancelation:\n            mode: NOTIFY_THEN_TERMINATE\n            notifyPeriodInSeconds: 30\n";
    }
}

/// The text of the template, YAML.
///
/// # Errors
/// A name or an option has `{{` or `}}`, which Open Job Description takes for an expression, or a control character.
pub fn template(options: &TemplateOptions) -> Result<String, FarmError> {
    let (factor, extra) = MEMORY_HEADROOM;
    let memory_mib = (factor * options.memory_bytes / f64::from(1 << 20) + extra).ceil() as u64;
    let name: String = options.name.chars().take(MAX_NAME).collect();
    let text = format!(
        "specificationVersion: {SPECIFICATION}\nextensions: [TASK_CHUNKING]\nname: {}\nparameterDefinitions:\n",
        literal(&name)?
    );
    let mut template = Template { text, memory_mib };
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
    if let Some(frame) = options.snapshot_frame {
        let description = "The first frame of the last chunk, up to which snapshots are made.";
        template.parameter("SnapshotFrame", "INT", description, Some(frame.to_string()));
    }
    Ok(())
}

fn steps(template: &mut Template, options: &TemplateOptions) -> Result<(), FarmError> {
    let extra = options.options.iter().map(|option| literal(option)).collect::<Result<Vec<_>, _>>()?;
    let command = |words: &[&str], more: &[&str]| -> Vec<String> {
        let shared = ["--out={{Param.OutputFolder}}/{{Param.FrameName}}", "--size={{Param.Size}}"];
        let all = words.iter().chain(&shared).chain(more).map(|word| quoted(word));
        all.chain(extra.clone()).chain(["--", "{{Param.SceneFile}}"].map(quoted)).collect()
    };
    let snapshots = "--snapshots={{Param.OutputFolder}}/states";
    let mut frames = vec!["--frames={{Task.Param.Frame}}", "--resume"];
    let never = format!("--snapshot-every={NO_MORE_SNAPSHOTS}");
    if options.snapshot_frame.is_some() {
        frames.extend([snapshots, &never]);
        let more = ["--frames={{Param.SnapshotFrame}}", snapshots, "--snapshot-every={{Param.ChunkFrames}}"];
        template.step("Snapshots", None, "", &command(&["render"], &more));
    }
    let space = format!(
        "    parameterSpace:\n      taskParameterDefinitions:\n        - name: Frame\n          type: CHUNK[INT]\n          range: \"{{{{Param.Frames}}}}\"\n          \
         chunks:\n            defaultTaskCount: \"{{{{Param.ChunkFrames}}}}\"\n            targetRuntimeSeconds: {}\n            rangeConstraint: CONTIGUOUS\n",
        options.task_s
    );
    let after = options.snapshot_frame.map(|_| "Snapshots");
    template.step("Frames", after, &space, &command(&["render"], &frames));
    options.film.as_deref().map(literal).transpose()?;
    let film = options.film.as_ref().map(|film| format!("--film={{{{Param.OutputFolder}}}}/{film}"));
    let mut more = vec!["--frames={{Param.Frames}}"];
    more.extend(film.as_deref());
    template.step("Finish", Some("Frames"), "", &command(&["farm", "finish"], &more));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> TemplateOptions {
        TemplateOptions {
            name: "wet street".into(),
            scene: Some("a \"b\".toml".into()),
            frame_name: "a.####.png".into(),
            frames: "0-59".into(),
            size: [96, 64],
            chunk_frames: 10,
            task_s: 1800,
            snapshot_frame: Some(50),
            options: vec!["--set=a.b=\"c\"".into()],
            film: Some("a.apng".into()),
            memory_bytes: 1e9,
        }
    }

    #[test]
    fn the_steps_follow_each_other() {
        let text = template(&options()).unwrap();
        for lines in [
            "specificationVersion: jobtemplate-2023-09\nextensions: [TASK_CHUNKING]\nname: \"wet street\"\n",
            "    default: \"a \\\"b\\\".toml\"\n",
            "  - name: Frames\n    dependencies:\n      - dependsOn: Snapshots\n",
            "  - name: Finish\n    dependencies:\n      - dependsOn: Frames\n",
            "          type: CHUNK[INT]\n          range: \"{{Param.Frames}}\"\n",
            "            - \"--set=a.b=\\\"c\\\"\"\n",
            "            - \"--film={{Param.OutputFolder}}/a.apng\"\n",
            "          min: 1687\n",
        ] {
            assert!(text.contains(lines), "{lines}\n{text}");
        }
        let alone = template(&TemplateOptions { snapshot_frame: None, scene: None, film: None, ..options() }).unwrap();
        assert!(!alone.contains("Snapshot") && !alone.contains("states") && !alone.contains("--film"), "{alone}");
    }

    #[test]
    fn what_would_be_an_expression_is_refused() {
        for bad in [
            TemplateOptions { frame_name: "{{Param.Size}}.png".into(), ..options() },
            TemplateOptions { options: vec!["--set=a={{b}}".into()], ..options() },
        ] {
            assert!(matches!(template(&bad), Err(FarmError::Braces { .. })));
        }
    }
}
