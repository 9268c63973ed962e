//! An effect that follows a program's time and writes into the program's arrays.

use std::sync::Arc;

use bansho::{
    AlphaMode, Animated, CameraParameters, ColorSpace, EffectError, LiveEffect, Picture, View,
    base::parameters::{Parameters, Reader, Value},
};
use numpy::{PyReadwriteArray2, PyReadwriteArray3, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};

use crate::{assets::Arrays, error, frame, scene, shot, value, work};

/// A live effect: `bansho.Effect` is the class that users see.
#[pyclass(module = "bansho._bansho", frozen)]
pub(crate) struct Effect {
    live: work::PoolMutex<LiveEffect>,
    threads: usize,
}

/// Why a call on an effect fails.
enum Failure {
    Effect(EffectError),
    Other(String),
}

impl<E: Into<EffectError>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Effect(error.into())
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Effect(reason) => error::effect(&reason),
            Failure::Other(message) => error::value(message),
        }
    }
}

impl Effect {
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut LiveEffect) -> Result<R, Failure> + Send,
    ) -> PyResult<R> {
        let done = self.live.run(py, self.threads, |live, interruption| {
            live.set_observer(Arc::new(interruption.clone()));
            work(live)
        })?;
        Ok(done?)
    }

    /// Writes the current picture into the pixels of an array.
    fn write<T: Send + Sync + numpy::Element>(
        &self,
        py: Python<'_>,
        out: &mut PyReadwriteArray3<T>,
        write: impl FnOnce(&Picture, &mut [T]) -> Result<(), Failure> + Send,
    ) -> PyResult<()> {
        let shape = out.shape().to_vec();
        let pixels = out.as_slice_mut().map_err(|_| gaps())?;
        self.with(py, |live| {
            let [width, height] = live.size();
            if shape != [height, width, 4] {
                let allowed = format!("({height}, {width}, 4)");
                return Err(Failure::Other(format!("an array of shape {shape:?}; allowed: {allowed}")));
            }
            write(&live.picture()?, pixels)
        })
    }
}

fn gaps() -> PyErr {
    error::value("an array with gaps between its rows; allowed: a contiguous array".to_owned())
}

#[pymethods]
impl Effect {
    #[new]
    #[pyo3(signature = (text, name, arrays, *, size, seed, loop_s, backdrop, layers, aovs, shutter_s, max_steps, threads))]
    #[allow(clippy::fn_params_excessive_bools, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        text: &str,
        name: &str,
        arrays: &Arrays,
        size: Option<[usize; 2]>,
        seed: Option<u64>,
        loop_s: Option<f64>,
        backdrop: bool,
        layers: bool,
        aovs: bool,
        shutter_s: Option<f64>,
        max_steps: Option<u64>,
        threads: Option<i64>,
    ) -> PyResult<Self> {
        let threads = work::thread_count(threads)?;
        let mut effect = bansho::Effect::from_scene(scene::parse(text, name)?)
            .backdrop(backdrop)
            .layers(layers)
            .aovs(aovs)
            .assets(arrays.assets());
        if let Some([width, height]) = size {
            effect = effect.size(width, height);
        }
        if let Some(seed) = seed {
            effect = effect.seed(seed);
        }
        if let Some(seconds) = loop_s {
            effect = effect.looping(seconds);
        }
        if let Some(seconds) = shutter_s {
            effect = effect.shutter(seconds);
        }
        if let Some(steps) = max_steps {
            effect = effect.max_steps(steps);
        }
        let opened = work::run(py, threads, |interruption| effect.observer(Arc::new(interruption.clone())).open())?;
        let live = opened.map_err(|refused| error::effect(&refused))?;
        Ok(Self { live: work::PoolMutex::new(live), threads })
    }

    fn advance(&self, py: Python<'_>, dt: f64) -> PyResult<f64> {
        self.with(py, |live| Ok(live.advance(dt)?.owed_s()))
    }

    fn at(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        self.with(py, |live| Ok(live.at(seconds).map(drop)?))
    }

    fn restart(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |live| Ok(live.restart()?))
    }

    fn set_wind(&self, py: Python<'_>, velocity: [f64; 3], gust: f64) -> PyResult<()> {
        self.with(py, |live| Ok(live.set_wind(velocity, gust)?))
    }

    fn set_size(&self, py: Python<'_>, width: usize, height: usize) -> PyResult<()> {
        self.with(py, |live| Ok(live.set_size(width, height)?))
    }

    fn set_exposure_ev100(&self, py: Python<'_>, exposure_ev100: f64) -> PyResult<()> {
        self.with(py, |live| Ok(live.set_exposure_ev100(exposure_ev100)?))
    }

    /// Sets keys of the camera; the others stay.
    fn set_camera(&self, py: Python<'_>, keys: &Bound<PyDict>) -> PyResult<()> {
        let Value::Table(given) = value::from_python(keys.as_any())? else {
            return Err(error::value("the camera is a dict of its keys".to_owned()));
        };
        self.with(py, |live| {
            let mut table = live.camera().to_table();
            table.entries.retain(|entry| given.get(&entry.key).is_none());
            table.entries.extend(given.entries);
            let mut reader = Reader::new();
            let camera = reader.within("camera", |reader| {
                CameraParameters::report_unknown(&table, reader, &[]);
                CameraParameters::read_table(&table, reader, &[])
            });
            if !reader.is_clean() {
                return Err(Failure::Effect(bansho::ParameterProblems(reader.into_problems()).into()));
            }
            Ok(live.set_camera(camera)?)
        })
    }

    fn ignite(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.with(py, |live| Ok(live.ignite(name)?))
    }

    fn extinguish(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.with(py, |live| Ok(live.extinguish(name)?))
    }

    fn set_flow(&self, py: Python<'_>, name: &str, flow: f64) -> PyResult<()> {
        self.with(py, |live| Ok(live.set_flow(name, flow)?))
    }

    fn move_to(&self, py: Python<'_>, name: &str, position: [f64; 3], seconds: f64) -> PyResult<()> {
        self.with(py, |live| Ok(live.move_to(name, position, seconds)?))
    }

    /// Sets the rain rate of the rain `name`.
    fn set_rain_rate(&self, py: Python<'_>, name: &str, rate_mm_per_h: f64) -> PyResult<()> {
        self.with(py, |live| {
            let Some(rain) = live.parameters::<bansho::RainParameters>(name) else {
                return Err(Failure::Other(format!("there is no rain {name:?}")));
            };
            let rain = bansho::RainParameters { rate_mm_per_h: Animated::from(rate_mm_per_h), ..rain.clone() };
            Ok(live.set_parameters(name, rain)?)
        })
    }

    /// Premultiplied light, single floats.
    fn write_floats(&self, py: Python<'_>, mut out: PyReadwriteArray3<f32>, space: &str) -> PyResult<()> {
        let space = match space {
            "acescg" => ColorSpace::AcesCg,
            "linear_srgb" => ColorSpace::LinearSrgb,
            _ => return Err(error::value(format!("space: {space:?}; allowed: \"acescg\", \"linear_srgb\""))),
        };
        self.write(py, &mut out, |picture, pixels| {
            picture.write_rgba32f(space, pixels).map_err(|length| Failure::Other(length.to_string()))
        })
    }

    /// Display codes, 8 bits.
    fn write_codes(
        &self,
        py: Python<'_>,
        mut out: PyReadwriteArray3<u8>,
        view: &str,
        alpha: &str,
        is_premultiplied: bool,
    ) -> PyResult<()> {
        let view: View = shot::parse_view(view)?;
        let convention = frame::parse_alpha(alpha)?;
        let alpha =
            if is_premultiplied { AlphaMode::Premultiplied(convention) } else { AlphaMode::Straight(convention) };
        self.write(py, &mut out, |picture, codes| {
            picture.write_rgba8(&view, alpha, codes).map_err(|length| Failure::Other(length.to_string()))
        })
    }

    /// Depth, m.
    fn write_depth(&self, py: Python<'_>, mut out: PyReadwriteArray2<f32>) -> PyResult<()> {
        self.write_plane(py, &mut out, |picture, values| {
            picture.write_depth32f(values).map_err(|length| Failure::Other(length.to_string()))
        })
    }

    /// A channel of a layer or an AOV.
    fn write_channel(&self, py: Python<'_>, channel: &str, mut out: PyReadwriteArray2<f32>) -> PyResult<()> {
        self.write_plane(py, &mut out, |picture, values| {
            picture.write_channel32f(channel, values).map_err(|refused| Failure::Other(refused.to_string()))
        })
    }

    fn particles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let cloud = self.with(py, |live| Ok(live.particles()))?;
        frame::cloud_dictionary(py, cloud)
    }

    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.live.read(py, LiveEffect::time)
    }

    #[getter]
    fn owed_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.live.read(py, LiveEffect::owed_s)
    }

    #[getter]
    fn size(&self, py: Python<'_>) -> PyResult<[usize; 2]> {
        self.live.read(py, LiveEffect::size)
    }

    #[getter]
    fn wind(&self, py: Python<'_>) -> PyResult<([f64; 3], f64)> {
        self.live.read(py, LiveEffect::wind)
    }

    #[getter]
    fn is_simulated(&self, py: Python<'_>) -> PyResult<bool> {
        self.live.read(py, LiveEffect::is_simulated)
    }
}

impl Effect {
    fn write_plane(
        &self,
        py: Python<'_>,
        out: &mut PyReadwriteArray2<f32>,
        write: impl FnOnce(&Picture, &mut [f32]) -> Result<(), Failure> + Send,
    ) -> PyResult<()> {
        let shape = out.shape().to_vec();
        let values = out.as_slice_mut().map_err(|_| gaps())?;
        self.with(py, |live| {
            let [width, height] = live.size();
            if shape != [height, width] {
                return Err(Failure::Other(format!("an array of shape {shape:?}; allowed: ({height}, {width})")));
            }
            write(&live.picture()?, values)
        })
    }
}
