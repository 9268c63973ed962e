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
    args::{DeflectionArgs, FlameStatisticsArgs, KernelTexture, Numbers, PlotArgs, PlotCommand, PlotOutputArgs},
    output::print,
    plot::{
        PlotError, aurora, beam, black_body, csv, draw,
        figure::Figure,
        flame_shape, flame_statistics, kernel, metadata, parameters, rain,
        texture::{self, FigureTexture},
        transfer_curves,
    },
};

/// Plots what is asked for.
pub(crate) fn run(args: &PlotArgs) -> anyhow::Result<()> {
    match &args.what {
        PlotCommand::BlackBody(args) => {
            let temperatures = black_body::Temperatures { from: args.from, to: args.to, step: args.step };
            match args.texture {
                None => finish("black-body", &black_body::figure(temperatures)?, &args.output, &[]),
                Some(encoding) => {
                    finish_texture("black-body", &black_body::texture(temperatures, encoding)?, &args.output, &[])
                }
            }
        }
        PlotCommand::Kernel(args) => match args.texture {
            None => finish("kernel", &kernel::figure(), &args.output, &[]),
            Some(KernelTexture::Density) => {
                finish_texture("kernel", &kernel::density_texture(args.size), &args.output, &[])
            }
            Some(KernelTexture::Deflection) => {
                finish_texture("kernel", &kernel::deflection_texture(args.size), &args.output, &[])
            }
        },
        PlotCommand::Deflection(args) => plot_deflection(args),
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
        PlotCommand::FlameShape(args) => {
            let figure = flame_shape::figure(&read(&args.scene)?, args.name.as_deref(), args.time, args.height)?;
            finish("flame-shape", &figure, &args.output, std::slice::from_ref(&args.scene))
        }
        PlotCommand::FlameStatistics(args) => plot_flame_statistics(args),
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

/// Draws the deflection of a frame, and prints how much it is.
fn plot_deflection(args: &DeflectionArgs) -> anyhow::Result<()> {
    let DeflectionArgs { scene, frame, full_scale, .. } = args;
    let drawn = texture::deflection(&read(scene)?, *frame, *full_scale)?;
    let inputs = std::slice::from_ref(scene);
    finish_texture("deflection", &drawn.texture, &args.output, inputs)?;
    Ok(print(&format!(
        "largest deflection: {} rad, {} pixels of what is far behind; 0 and 255 are {} rad\n",
        csv::number(drawn.largest_rad),
        csv::number((1e3 * drawn.largest_pixels).round() * 1e-3),
        csv::number(drawn.full_scale_rad)
    ))?)
}

/// Plots statistics of a flame over the frames, and prints those of the film.
fn plot_flame_statistics(args: &FlameStatisticsArgs) -> anyhow::Result<()> {
    let FlameStatisticsArgs { scene, frames, height, output } = args;
    let measured = flame_statistics::measure(&read(scene)?, *frames as usize, *height as usize)?;
    finish("flame-statistics", &measured.figure, output, std::slice::from_ref(scene))?;
    // Standard output has the table.
    if output.out.as_deref() == Some(Path::new("-")) { Ok(()) } else { Ok(print(&measured.summary())?) }
}

/// The path of the figure called `name`.
fn output_path(name: &str, extension: &str, output: &PlotOutputArgs) -> PathBuf {
    output.out.clone().unwrap_or_else(|| Path::new("out/plots").join(name).with_extension(extension))
}

/// Writes the figure called `name`, over none of its `inputs`.
fn finish(name: &str, figure: &Figure, output: &PlotOutputArgs, inputs: &[PathBuf]) -> anyhow::Result<()> {
    let path = output_path(name, "svg", output);
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
    write(&path, &bytes, output, inputs)
}

/// Writes a texture as PNG, over none of its `inputs`.
fn finish_texture(
    name: &str,
    texture: &FigureTexture,
    output: &PlotOutputArgs,
    inputs: &[PathBuf],
) -> anyhow::Result<()> {
    let path = output_path(name, "png", output);
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        return Err(PlotError::TextureExtension { path }.into());
    }
    let encode = if texture.is_linear { png::encode_linear_document } else { png::encode_document };
    let bytes = encode(&texture.picture, &path).map_err(JobError::from)?;
    write(&path, &bytes, output, inputs)
}

/// Writes a file, over none of `inputs`.
fn write(path: &Path, bytes: &[u8], output: &PlotOutputArgs, inputs: &[PathBuf]) -> anyhow::Result<()> {
    let mut files = InputFiles::default();
    inputs.iter().for_each(|input| files.insert(input));
    let policy = OverwritePolicy::new(files, output.policy.overwrite);
    policy.check(path).map_err(|kept| {
        let path = path.to_path_buf();
        JobError::Option(match kept {
            OverwriteError::Input => OptionError::OutputIsInput { path },
            OverwriteError::NotMadeByBansho | OverwriteError::Link => OptionError::NotMadeByBansho { path, others: 0 },
        })
    })?;
    atomic::write_bytes(path, bytes, &policy).map_err(JobError::from)?;
    Ok(print(&format!("{}: written\n", printable(&path.display().to_string())))?)
}
