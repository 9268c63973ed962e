//! The compiled part of the Python package `bansho`: what the library has, as functions and classes that take and return arrays. The modules in `bansho/`
//! give it the form that users see, with its documentation.
//!
//! | module | what it has |
//! | --- | --- |
//! | [`scene`] | the text of a scene: checked, changed, read by path |
//! | [`value`] | values of a scene as Python objects |
//! | [`tables`] | descriptors of all tables, for the keyword builders |
//! | [`assets`] | pictures and depths that are arrays |
//! | [`shot`], [`frame`] | frames as arrays, particles, lights |
//! | [`frame_stream`] | frames that are drawn ahead, several at a time |
//! | [`plate_shot`] | weather over single pictures |
//! | [`effect`] | what follows a program's time |
//! | [`job`] | files |
//! | [`curves`] | the physics behind the pictures |
//! | [`work`] | threads, signals, panics |
//! | [`error`] | exceptions |

#![forbid(unsafe_code)]

mod assets;
mod curves;
mod effect;
mod error;
mod frame;
mod frame_stream;
mod job;
mod plate_shot;
mod scene;
mod shot;
mod tables;
mod value;
mod work;

use pyo3::prelude::*;

/// Panics within a pool, as a fault of the library would: for the test that the interpreter lives.
#[pyfunction]
fn panic_for_test(py: Python<'_>, message: String) -> PyResult<()> {
    work::run(py, 1, |_| panic!("{message}"))
}

/// The compiled part of `bansho`.
#[pymodule]
mod _bansho {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::{
        assets::Arrays,
        curves::{
            aurora_deposition, aurora_emission, aurora_lines, aurora_quenching, black_body_radiance, drop_density,
            rain_extinction, streak_opacity, streak_textures, terminal_velocity,
        },
        effect::Effect,
        frame::linear_srgb_of_acescg,
        frame_stream::{FrameStream, stream_for_test},
        job::write_files,
        panic_for_test,
        plate_shot::PlateShot,
        scene::{
            asset_paths, check_scene, read_scene, stated_values, text_of_tables, value_at, with_table, with_values,
            without_value,
        },
        shot::Shot,
        tables::table_descriptors,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("PHOTONS_PER_KILORAYLEIGH", super::curves::KILORAYLEIGH)
    }
}
