//! A drawn frame as arrays. The vectors of the library are moved into numpy, which then owns them.

use bansho::{
    AlphaConvention, ColorSpace, DisplayImage, Frame, Image, Plan,
    base::{
        color::LinearTransform,
        frame::{DisplayPixels, Precision},
        geometry::point_cloud::PointCloud,
        math::simd,
    },
};
use numpy::{
    Element, IntoPyArray, PyArray2, PyArray3, PyReadonlyArray3, PyUntypedArrayMethods,
    ndarray::{Array2, Array3},
};
use pyo3::{prelude::*, types::PyDict};

use crate::error;

/// Values in rows as an array, height x width x channels.
pub(crate) fn array3<T: Element>(
    py: Python<'_>,
    [height, width, channels]: [usize; 3],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray3<T>>> {
    let array = Array3::from_shape_vec((height, width, channels), values);
    Ok(array.map_err(|shape| error::internal(shape.to_string()))?.into_pyarray(py))
}

/// Values in rows as an array, height x width.
pub(crate) fn array2<T: Element>(
    py: Python<'_>,
    [height, width]: [usize; 2],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let array = Array2::from_shape_vec((height, width), values);
    Ok(array.map_err(|shape| error::internal(shape.to_string()))?.into_pyarray(py))
}

/// A picture of floats as an array.
pub(crate) fn image_array<const N: usize>(py: Python<'_>, image: Image<N>) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let shape = [image.height(), image.width(), N];
    array3(py, shape, image.into_pixels().into_flattened())
}

/// Everything that a frame of light has, by name.
pub(crate) fn frame_dictionary<'py>(py: Python<'py>, frame: Frame) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    let size = [frame.beauty.height(), frame.beauty.width()];
    dictionary.set_item("number", frame.header.number)?;
    dictionary.set_item("exposure_ev100", frame.header.exposure_ev100)?;
    dictionary.set_item("white_balance_k", frame.header.white_balance_k)?;
    dictionary.set_item("exposure_s", frame.header.exposure_time_s)?;
    dictionary.set_item("opaque", frame.opaque)?;
    dictionary.set_item("linear", image_array(py, frame.beauty)?)?;
    let depth = frame.depth.map(|depth| array2(py, size, depth)).transpose()?;
    dictionary.set_item("depth", depth)?;
    let channels = PyDict::new(py);
    for channel in frame.channels {
        let is_color = channel.precision == Precision::Half;
        channels.set_item(&channel.name, (array2(py, size, channel.values)?, is_color))?;
    }
    dictionary.set_item("channels", channels)?;
    let mut figures = Vec::new();
    for metadata in &frame.metadata {
        for entry in &metadata.entries {
            figures.push((metadata.phenomenon.clone(), entry.name, entry.unit, entry.value));
        }
    }
    dictionary.set_item("figures", figures)?;
    Ok(dictionary)
}

/// Display codes as an array of 8 or 16 bits, height x width x 4.
pub(crate) fn display_array(py: Python<'_>, image: DisplayImage) -> PyResult<Bound<'_, PyAny>> {
    let shape = [image.height, image.width, 4];
    Ok(match image.pixels {
        DisplayPixels::Eight(codes) => array3(py, shape, codes.into_flattened())?.into_any(),
        DisplayPixels::Sixteen(codes) => array3(py, shape, codes.into_flattened())?.into_any(),
    })
}

/// The camera of frame `number` of a plan.
pub(crate) fn camera_dictionary<'py>(py: Python<'py>, plan: &Plan, number: i64) -> PyResult<Bound<'py, PyDict>> {
    let shutter = plan.shutter(number);
    let middle = shutter.middle();
    let camera = plan.camera.of_exposure(middle, plan.fps().frame_s()).at(middle, plan.size());
    let dictionary = PyDict::new(py);
    dictionary.set_item("lens", camera.lens.name())?;
    dictionary.set_item("position", camera.position.to_array())?;
    // Columns: right, up, backward.
    dictionary.set_item("rotation", camera.world_from_camera.to_cols_array_2d())?;
    dictionary.set_item("focal_pixels", camera.focal_pixels)?;
    dictionary.set_item("principal_point", camera.principal_point.to_array())?;
    dictionary.set_item("size", plan.size())?;
    dictionary.set_item("shutter", (shutter.open, shutter.close))?;
    Ok(dictionary)
}

/// Points as arrays by name, each with its unit.
pub(crate) fn cloud_dictionary<'py>(py: Python<'py>, cloud: PointCloud) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    let count = cloud.len();
    let mut positions = Vec::with_capacity(3 * count);
    for index in 0..count {
        positions.extend(cloud.position(index));
    }
    dictionary.set_item("position", (array2(py, [count, 3], positions)?, "m"))?;
    dictionary.set_item("velocity", (array2(py, [count, 3], cloud.velocities.into_flattened())?, "m/s"))?;
    for (quantity, values) in cloud.quantities {
        dictionary.set_item(quantity.name(), (values.into_pyarray(py), quantity.unit()))?;
    }
    Ok(dictionary)
}

/// Premultiplied ACEScg as linear sRGB, height x width x 4. The white balance of the camera is not applied.
#[pyfunction]
pub(crate) fn linear_srgb_of_acescg<'py>(
    py: Python<'py>,
    linear: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let shape = linear.shape();
    let (&[height, width, 4], Ok(values)) = (shape, linear.as_slice()) else {
        return Err(error::value(format!("an array of shape {shape:?}; allowed: (height, width, 4) without gaps")));
    };
    let mut converted = vec![[0.0; 4]; height * width];
    let transform = LinearTransform::new(ColorSpace::LinearSrgb, None);
    transform.rgba32f_row(simd::level(), values.as_chunks().0, &mut converted);
    array3(py, [height, width, 4], converted.into_flattened())
}

/// The convention of a name.
pub(crate) fn parse_alpha(name: &str) -> PyResult<AlphaConvention> {
    AlphaConvention::from_name(name)
        .ok_or_else(|| error::value(format!("alpha: {name:?}; allowed: \"encoded\", \"linear\", None")))
}
