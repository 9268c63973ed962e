//! The command line.

mod flipbook;
mod input;
mod render;
mod simulate;
mod streaks;
mod values;
mod work;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub(crate) use self::{
    flipbook::FlipbookArgs, input::InputArgs, render::RenderArgs, simulate::SimulateArgs, streaks::StreaksArgs,
    work::WorkArgs,
};

/// Flames, rain and aurora for pictures: image sequences with alpha to lay over a plate.
#[derive(Debug, Parser)]
#[command(
    name = "bansho",
    version,
    after_help = "\
Examples:
  bansho new fire                      write fire.toml, a short scene to change
  bansho render fire.toml              240 PNG files with alpha in out/fire/
  bansho render fire.toml -o fire.mp4  a film
  bansho render --help                 all that `render` can do

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 faulty scene, 4 no usable GPU, 130 or 143 interrupted."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write a new scene file: what one changes first, or every setting, each explained.
    New(NewArgs),
    /// Check scene files and print the position of every error.
    Check(CheckArgs),
    /// Rewrite a scene file of an older format for this version; comments stay.
    Upgrade(UpgradeArgs),
    /// Print the JSON schema of scene files, for editors that complete and check while one types.
    Schema,
    /// Draw a scene: files, a film, or a contact sheet.
    Render(RenderArgs),
    /// Draw a scene as a flipbook for game engines: color, alpha and motion sheets and a JSON.
    Flipbook(FlipbookArgs),
    /// Write streak textures of rain with every drop's diameter, velocity and opacity.
    Streaks(StreaksArgs),
    /// Simulate a scene and write its particles, for other programs.
    Simulate(SimulateArgs),
    /// Print what the light of an aurora comes to, by the energy of its electrons, and whether that is what is observed.
    Calibrate,
    /// Open a scene in the studio, a program of its own: shape it with the mouse and see it at once.
    Studio(StudioArgs),
    /// Print a completion script for a shell.
    Completions(CompletionsArgs),
    /// Print the manual page, or write those of all commands.
    Man(ManArgs),
}

/// `bansho new`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  bansho new fire                    fire.toml, a short scene of a flame sheet
  bansho new fire --all              the same with every setting explained
  bansho new wet --kind rain         wet.toml, rain around a lamp
  bansho new --list                  the examples that come with the program
  bansho new camp --from campfire    camp.toml, a copy of the campfire")]
pub(crate) struct NewArgs {
    /// Name of the scene; `.toml` is added where it has no extension. A file that is there already stays as it is.
    #[arg(required_unless_present = "list")]
    pub(crate) name: Option<PathBuf>,
    /// What the scene shows: flame_sheet (the default), flame_particles, rain or aurora.
    #[arg(long, value_name = "KIND", conflicts_with = "from")]
    pub(crate) kind: Option<String>,
    /// Write every setting with its purpose and allowed values, not only those that are changed most often.
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
    #[command(flatten)]
    pub(crate) inputs: InputArgs,
}

/// `bansho upgrade`
#[derive(Args, Debug)]
pub(crate) struct UpgradeArgs {
    /// The scene file.
    pub(crate) scene: PathBuf,
}

/// `bansho studio`
#[derive(Args, Debug)]
pub(crate) struct StudioArgs {
    /// The scene file; a new scene without it.
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
    /// Folder to write the pages of all commands to; without it the main page is printed.
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
            // Neighbors that are no examples would be one paragraph, broken by hand.
            let is_text = |line: &str| !line.is_empty() && !line.starts_with("  ");
            let lines: Vec<&str> = help.lines().collect();
            assert!(!lines.windows(2).any(|pair| is_text(pair[0]) && is_text(pair[1])), "{name}: {help}");
        }
    }
}
