//! `bansho plot`

use std::{
    io,
    path::{Path, PathBuf},
};

use bansho::{
    base::host::printable::printable,
    job::{JobError, OptionError, SceneFile},
    media::{
        files::{
            atomic,
            overwrite_policy::{InputFiles, OverwriteError, OverwritePolicy},
        },
        png,
    },
};

use crate::{
    args::{Numbers, PlotArgs, PlotCommand, PlotOutputArgs},
    output::print,
    plot::{
        PlotError, aurora, beam, black_body, csv, draw, figure::Figure, metadata, parameters, rain, transfer_curves,
    },
};

/// Plots what is asked for.
pub(crate) fn run(args: &PlotArgs) -> anyhow::Result<()> {
    match &args.what {
        PlotCommand::BlackBody(args) => {
            let temperatures = black_body::Temperatures { from: args.from, to: args.to, step: args.step };
            finish("black-body", &black_body::figure(temperatures)?, &args.output, &[])
        }
        PlotCommand::DropSizes(args) => {
            let Numbers(rates) = &args.rates;
            finish("drop-sizes", &rain::drop_sizes(rates), &args.output, &[])
        }
        PlotCommand::TerminalVelocity(args) => {
            finish("terminal-velocity", &rain::terminal_velocity(), &args.output, &[])
        }
        PlotCommand::StreakOpacity(args) => {
            let Numbers(times) = &args.exposure_times;
            finish("streak-opacity", &rain::streak_opacity(times, args.terminal_velocity), &args.output, &[])
        }
        PlotCommand::Beam(args) => {
            let Numbers(rates) = &args.rates;
            let cones = [args.inner_cone_deg, args.outer_cone_deg];
            finish("beam", &beam::figure(args.intensity, cones, rates)?, &args.output, &[])
        }
        PlotCommand::Emission(args) => {
            let figure = aurora::emission(args.energy_ev, args.flux_mw_per_m2, args.spectrum);
            finish("emission", &figure, &args.output, &[])
        }
        PlotCommand::Deposition(args) => {
            let Numbers(energies) = &args.energies_ev;
            finish("deposition", &aurora::deposition(energies, args.spectrum), &args.output, &[])
        }
        PlotCommand::Quenching(args) => finish("quenching", &aurora::quenching(), &args.output, &[]),
        PlotCommand::Parameters(args) => {
            let figure = parameters::figure(&read(&args.scene)?, &args.path)?;
            finish("parameters", &figure, &args.output, std::slice::from_ref(&args.scene))
        }
        PlotCommand::TransferCurves(args) => {
            let figure = transfer_curves::figure(&read(&args.scene)?, args.name.as_deref())?;
            finish("transfer-curves", &figure, &args.output, std::slice::from_ref(&args.scene))
        }
        PlotCommand::Metadata(args) => finish("metadata", &metadata::figure(&args.files)?, &args.output, &args.files),
    }
}

/// Reads a scene, from standard input where its path is `-`.
fn read(path: &Path) -> Result<SceneFile, JobError> {
    match path.to_str() {
        Some("-") => SceneFile::read_stream("stdin", io::stdin().lock()),
        _ => SceneFile::read(path),
    }
}

/// Writes the figure called `name`, over none of its `inputs`.
fn finish(name: &str, figure: &Figure, output: &PlotOutputArgs, inputs: &[PathBuf]) -> anyhow::Result<()> {
    let path = output.out.clone().unwrap_or_else(|| Path::new("out/plots").join(name).with_extension("svg"));
    if path.as_os_str() == "-" {
        return Ok(print(&csv::encode(&figure.title, &figure.table))?);
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let bytes = match extension.to_str() {
        Some("csv") => csv::encode(&figure.title, &figure.table).into_bytes(),
        Some("svg") => draw::svg(figure).into_bytes(),
        Some("png") => {
            let panels = figure.panels.len();
            let picture = draw::picture(figure).ok_or_else(|| PlotError::Panels { path: path.clone(), panels })?;
            png::encode_document(&picture, &path).map_err(JobError::from)?
        }
        _ => return Err(PlotError::Extension { path }.into()),
    };
    let mut files = InputFiles::default();
    inputs.iter().for_each(|input| files.insert(input));
    let policy = OverwritePolicy::new(files, output.policy.overwrite);
    policy.check(&path).map_err(|kept| {
        let path = path.clone();
        JobError::Option(match kept {
            OverwriteError::Input => OptionError::OutputIsInput { path },
            OverwriteError::NotMadeByBansho => OptionError::NotMadeByBansho { path, others: 0 },
        })
    })?;
    atomic::write_bytes_with(&path, &bytes, &policy).map_err(JobError::from)?;
    Ok(print(&format!("{}: written\n", printable(&path.display().to_string())))?)
}
