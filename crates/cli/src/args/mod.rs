//! The command line: the commands with their options, parsed by `clap`.

mod farm;
mod flipbook;
mod plot;
mod render;
mod shared;
mod simulate;
mod streaks;
mod values;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub(crate) use self::{
    farm::{
        CheckMachineArgs, FarmArgs, FarmCommand, FarmStatusArgs, FinishArgs, OpenjdArgs, SlurmArgs, SnapshotsArgs,
        TaskArgs, TaskCommand, ThreadArgs, TileArgs,
    },
    flipbook::FlipbookArgs,
    plot::{ColorTexture, DeflectionArgs, FlameStatisticsArgs, KernelTexture, PlotArgs, PlotCommand, PlotOutputArgs},
    render::RenderArgs,
    shared::{InputArgs, ProgressKind, WorkArgs},
    simulate::SimulateArgs,
    streaks::StreaksArgs,
    values::{ChunkLength, Frames, Numbers},
};

/// Fire, rain and aurora for pictures: image sequences with alpha, to composite over a plate.
#[derive(Debug, Parser)]
#[command(
    name = "bansho",
    version,
    after_help = "\
Examples:
  bansho new fire                      write fire.toml, a short scene to edit
  bansho render fire.toml              240 PNG files with alpha in out/fire/
  bansho render fire.toml -o fire.mp4  a video
  bansho render --help                 all options of `render`

Exit codes: 0 success, 1 failure, 2 invalid usage, 3 invalid scene, 130 or 143 interrupted."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write a new scene file: with the settings that are changed most often, or with all settings, each explained.
    New(NewArgs),
    /// Check scene files and print every error with its position.
    Check(CheckArgs),
    /// Print the JSON schema of scene files, for completion and checks in text editors.
    Schema,
    /// Draw a scene to pictures, a video, or a contact sheet.
    Render(RenderArgs),
    /// Draw a shot on many machines with their batch system.
    Farm(FarmArgs),
    /// Draw a scene as a flipbook for game engines: color, alpha and motion sheets, and a JSON file.
    Flipbook(FlipbookArgs),
    /// Write streak textures of rain, with the diameter, velocity and opacity of every drop.
    Streaks(StreaksArgs),
    /// Simulate a scene and write its particles for other programs.
    Simulate(SimulateArgs),
    /// Print the brightness of auroras for each energy of the electrons, and compare it with observations.
    Calibrate,
    /// Plot what the models compute, and what a scene states, as SVG, PNG or CSV.
    Plot(PlotArgs),
    /// Open a scene in the studio, a separate program for interactive editing.
    Studio(StudioArgs),
    /// Print a completion script for a shell.
    Completions(CompletionsArgs),
    /// Print the manual page, or write the pages of all commands.
    Man(ManArgs),
}

/// `bansho new`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  bansho new fire                    fire.toml, a short scene of a flame sheet
  bansho new fire --all              the same with all settings explained
  bansho new wet --kind rain         wet.toml, rain around a lamp
  bansho new --list                  the examples that come with the program
  bansho new camp --from campfire    camp.toml, a copy of the campfire")]
pub(crate) struct NewArgs {
    /// Name of the scene; `.toml` is added if it has no extension. An existing file is not overwritten.
    #[arg(required_unless_present = "list")]
    pub(crate) name: Option<PathBuf>,
    /// Kind of phenomenon: flame_sheet (the default), flame_particles, flame_volume, rain or aurora.
    #[arg(long, value_name = "KIND", conflicts_with = "from")]
    pub(crate) kind: Option<String>,
    /// Write all settings with their purpose and allowed values, not only those that are changed most often.
    #[arg(long, conflicts_with_all = ["from", "list"])]
    pub(crate) all: bool,
    /// Copy an example that comes with the program.
    #[arg(long, value_name = "EXAMPLE")]
    pub(crate) from: Option<String>,
    /// List the examples.
    #[arg(long, conflicts_with_all = ["name", "from", "kind"])]
    pub(crate) list: bool,
}

/// `bansho check`
#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// Scene files; `-` reads one from standard input.
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    /// List what does not follow the papers of the phenomena to the letter.
    #[arg(long)]
    pub(crate) paper: bool,
    #[command(flatten)]
    pub(crate) inputs: InputArgs,
}

/// `bansho studio`
#[derive(Args, Debug)]
pub(crate) struct StudioArgs {
    /// The scene file; if omitted, the studio opens a new scene.
    pub(crate) scene: Option<PathBuf>,
}

/// `bansho completions`
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  bansho completions bash > ~/.local/share/bash-completion/completions/bansho")]
pub(crate) struct CompletionsArgs {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}

/// `bansho man`
#[derive(Args, Debug)]
pub(crate) struct ManArgs {
    /// Write the pages of all commands to this folder; if omitted, the main page is printed.
    pub(crate) dir: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn examples_fit_a_terminal_and_paragraphs_wrap_at_its_width() {
        let cli = Cli::command();
        for command in cli.get_subcommands().chain([&cli]) {
            let Some(help) = command.get_after_help() else { continue };
            let (name, help) = (command.get_name(), help.to_string());
            assert!(help.lines().filter(|line| line.starts_with("  ")).all(|line| line.len() < 80), "{name}: {help}");
            // Consecutive lines that are not examples would be a paragraph with fixed line breaks.
            let is_text = |line: &str| !line.is_empty() && !line.starts_with("  ");
            let lines: Vec<&str> = help.lines().collect();
            assert!(!lines.windows(2).any(|pair| is_text(pair[0]) && is_text(pair[1])), "{name}: {help}");
        }
    }
}
