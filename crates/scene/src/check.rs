//! Checks of a scene beyond the ranges of single parameters.

use bansho_base::{
    camera::{Lens, VERTICAL_FOV_DEG},
    math::{self, DVec3},
    parameters::{Auto, BuildError, Node, ProblemKind, Range, Reader, Table, Value, nearest},
    tables::TableKind,
};

use crate::{FORMAT, PictureParameters, Scene, states_in, text::path::nearest_span};

/// Checks the format number. Returns whether to read the rest: another format has other keys, each of which would be reported as a further
/// problem.
pub(super) fn format(root: &Table, reader: &mut Reader) -> bool {
    let Some(node) = root.get("bansho") else {
        let kind = ProblemKind::Conflict(format!("the scene must begin with `bansho = {FORMAT}`, its format version"));
        reader.report_at(Some(0..0), kind);
        return true;
    };
    reader.within("bansho", |reader| match node.value {
        Value::Integer(FORMAT) => {}
        Value::Integer(found) => reader.report(node, ProblemKind::UnsupportedFormat { found, allowed: FORMAT }),
        _ => {
            let found = node.value.type_name();
            reader.report(node, ProblemKind::WrongType { expected: format!("the format version, {FORMAT}"), found });
        }
    });
    !matches!(node.value, Value::Integer(found) if found != FORMAT)
}

/// Reports keys at the root that no kind has.
pub(super) fn root_keys(root: &Table, kinds: &[TableKind], reader: &mut Reader) {
    let root_keys: Vec<&str> = std::iter::once("bansho").chain(kinds.iter().map(|kind| kind.key)).collect();
    for entry in &root.entries {
        if !root_keys.contains(&entry.key.as_str()) {
            reader.report_with(Some(entry.key_span.clone()), || ProblemKind::UnknownKey {
                key: entry.key.clone(),
                nearest: nearest(&entry.key, root_keys.iter().copied()).map(str::to_owned),
                allowed: root_keys.iter().map(|&key| key.to_owned()).collect(),
            });
        }
    }
}

/// Names of the layers of tables that are no phenomena, which no phenomenon may have.
pub(super) fn reserved_names(kinds: &[TableKind]) -> Vec<&'static str> {
    kinds.iter().filter_map(|kind| kind.layer).collect()
}

/// Names of the picture's own channels and layers in programs that read EXR files. A layer `Z` or `RGBA` makes OpenEXR's Python module refuse
/// a file; `Combined`, `Alpha` and `Depth` replace the picture's own in Blender; Nuke calls them `rgba`, `alpha` and `depth`.
pub(super) const NAMES_RESERVED_BY_READERS: [&str; 18] = [
    "R", "G", "B", "A", "X", "Y", "Z", "U", "V", "W", "RGB", "RGBA", "rgba", "Alpha", "alpha", "Depth", "depth",
    "Combined",
];

/// Maximum length of a name, bytes: Blender truncates names of layers, without the suffix after the dot, to this length.
pub(super) const MAX_NAME_BYTES: usize = 63;

/// Reads the name of a phenomenon. Its EXR layers have the same name, so it may not contain dots or control characters, and readers must not
/// change it.
pub(super) fn name(node: &Node, kinds: &[TableKind], reader: &mut Reader) -> Option<String> {
    let Value::Text(name) = &node.value else {
        let expected = format!("a name of {}", allowed_names(kinds));
        reader.report(node, ProblemKind::WrongType { expected, found: node.value.type_name() });
        return None;
    };
    match name_problem(name, kinds) {
        None => Some(name.clone()),
        Some(reason) => {
            reader.report(node, ProblemKind::Conflict(reason));
            None
        }
    }
}

/// Reports a name that a phenomenon cannot have.
pub(super) fn instance_name(name: &str, kinds: &[TableKind], reader: &mut Reader) {
    if let Some(reason) = name_problem(name, kinds) {
        reader.report_value(ProblemKind::Conflict(reason));
    }
}

fn allowed_names(kinds: &[TableKind]) -> String {
    let reserved = reserved_names(kinds).join(", ");
    format!("1 to {MAX_NAME_BYTES} bytes of text without dots and control characters, and none of {reserved}")
}

/// Why a phenomenon cannot have this name.
fn name_problem(name: &str, kinds: &[TableKind]) -> Option<String> {
    if NAMES_RESERVED_BY_READERS.contains(&name) {
        let others = NAMES_RESERVED_BY_READERS.join(", ");
        let problem = "cannot be a name, since programs that read EXR files take such a layer for the picture itself";
        return Some(format!("{problem}; allowed: any but {others}"));
    }
    if name.len() > MAX_NAME_BYTES {
        let problem = format!("is a name of {} bytes, which programs that read EXR files would truncate", name.len());
        return Some(format!("{problem}; allowed: {}", allowed_names(kinds)));
    }
    let has_control_or_dot = name.contains(|character: char| character == '.' || character.is_control());
    if name.trim().is_empty() || reserved_names(kinds).contains(&name) || has_control_or_dot {
        let problem = "cannot be a name, since the names of EXR channels begin with it";
        return Some(format!("{problem}; allowed: {}", allowed_names(kinds)));
    }
    None
}

/// Checks combinations of parameters.
pub(super) fn values(scene: &Scene, root: &Table, reader: &mut Reader) {
    camera(scene, root, reader);
    scene.tables.report_conflicts(root, reader);
    plate(scene, root, reader);
}

/// Reports to `reader` an error of what was built from the table at the dotted `path` of the scene `root`, at the position of its key.
pub fn report_build_error(error: BuildError, path: String, root: &Table, reader: &mut Reader) {
    let span = nearest_span(root, &format!("{path}.{}", error.key));
    reader.within(path, |reader| {
        reader.within(error.key, |reader| reader.report_at(span, error.kind));
    });
}

/// The target of the camera must differ from its position.
fn camera(scene: &Scene, root: &Table, reader: &mut Reader) {
    let [position, target] = [&scene.camera.position, &scene.camera.target].map(|point| point.at(0.0));
    if position == target {
        let kind = ProblemKind::Conflict("equals the camera's position; allowed: any other point".into());
        let span = nearest_span(root, "camera.target");
        reader.within("camera", |r| r.within("target", |r| r.report_at(span, kind)));
    }
    if scene.camera.up.values().iter().any(|up| DVec3::from(*up).try_normalize().is_none()) {
        let kind =
            ProblemKind::Conflict("is the zero vector; allowed: a vector with at least one nonzero component".into());
        report_build_error(BuildError { key: "up".into(), kind }, "camera".into(), root, reader);
    }
    field_of_view(scene, root, reader);
}

/// The focal length of a rectilinear lens that shows a vertical field of view on a sensor of this height, mm.
fn focal_length_mm(vertical_fov_deg: f64, sensor_height_mm: f64) -> f64 {
    0.5 * sensor_height_mm / math::tan(0.5 * vertical_fov_deg.to_radians())
}

/// The field of view of a focal length and a sensor has the same limits as one that is stated.
fn field_of_view(scene: &Scene, root: &Table, reader: &mut Reader) {
    let (camera, Range { min, max }) = (&scene.camera, VERTICAL_FOV_DEG);
    if camera.lens != Lens::Perspective {
        return;
    }
    let Some([narrowest, widest]) = camera.fov_of_focal_length() else { return };
    // The limits themselves are allowed, with a tolerance for rounding.
    let allowed = min * (1.0 - 1e-9)..=max * (1.0 + 1e-9);
    let Some(fov) = [widest, narrowest].into_iter().find(|fov| !allowed.contains(fov)) else { return };
    let sensor = camera.sensor_height_mm;
    let reason = format!(
        "gives a field of view of {fov:.3} degrees with a sensor of {sensor} mm; allowed: {min} to {max} degrees, here {:.3} to {:.0} mm",
        focal_length_mm(max, sensor),
        focal_length_mm(min, sensor)
    );
    report_build_error(
        BuildError { key: "focal_length_mm".into(), kind: ProblemKind::Conflict(reason) },
        "camera".into(),
        root,
        reader,
    );
}

/// The exposure is stated by a value, or by all settings of a camera.
pub(crate) fn exposure(root: &Table, reader: &mut Reader) {
    let (stated, missing): (Vec<&str>, Vec<&str>) =
        PictureParameters::CAMERA_SETTINGS.iter().partition(|key| states_in(root, "picture", key));
    let Some(first) = stated.first() else { return };
    let reason = if !missing.is_empty() {
        format!("an exposure by the settings of a camera also needs `{}`", missing.join("` and `"))
    } else if states_in(root, "picture", "exposure_ev100") {
        "the exposure is also stated by `exposure_ev100`; allowed: one of them".to_owned()
    } else {
        return;
    };
    let error = BuildError { key: (*first).into(), kind: ProblemKind::Conflict(reason) };
    report_build_error(error, "picture".into(), root, reader);
}

/// The depth, its known points, the surfaces and the exposure of a plate need its image.
fn plate(scene: &Scene, root: &Table, reader: &mut Reader) {
    if scene.plate.image.is_none() && scene.plate.depth.is_some() {
        let span = nearest_span(root, "plate.depth");
        let kind = ProblemKind::Conflict("`depth` needs an `image`".into());
        reader.within("plate", |r| r.within("depth", |r| r.report_at(span, kind)));
    }
    for (key, path) in [("albedo", &scene.plate.albedo), ("normal", &scene.plate.normal)] {
        if scene.plate.image.is_none() && path.is_some() {
            let kind = ProblemKind::Conflict(format!("`{key}` needs an `image`"));
            report_build_error(BuildError { key: key.into(), kind }, "plate".into(), root, reader);
        }
    }
    if scene.plate.image.is_none() && !scene.plate.depth_known.is_empty() {
        let kind = ProblemKind::Conflict("`depth_known` needs an `image`".into());
        report_build_error(BuildError { key: "depth_known".into(), kind }, "plate".into(), root, reader);
    }
    if scene.plate.image.is_none() && scene.plate.exposure_ev100 != Auto::Auto {
        let reason = "an exposure needs an `image` that was taken with it".to_owned();
        report_build_error(
            BuildError { key: "exposure_ev100".into(), kind: ProblemKind::Conflict(reason) },
            "plate".into(),
            root,
            reader,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds;

    #[test]
    fn an_exposure_is_a_value_or_all_settings_of_a_camera() {
        let parse = |picture: &str| {
            Scene::parse("night.toml", &format!("bansho = 2\n[picture]\n{picture}\n"), &[kinds::PICTURE])
        };
        let scene = parse("f_number = 2.0\nexposure_time_s = 4.0\niso = 1600").unwrap();
        // log2(4 / 4) - log2(16).
        assert_eq!(scene.picture.exposure_ev100, Auto::Set(-4.0));
        for (picture, expected) in [
            ("iso = 400", "also needs `f_number` and `exposure_time_s`"),
            (
                "f_number = 2.0\nexposure_time_s = 4.0\niso = 1600\nexposure_ev100 = -4.0",
                "also stated by `exposure_ev100`",
            ),
            ("f_number = 0.0\nexposure_time_s = 4.0\niso = 1600", "0.1"),
            ("f_number = 2.0\nexposure_time_s = 4.0\niso = 0", "1"),
        ] {
            let error = parse(picture).err().expect(picture);
            assert_eq!(error.problems.len(), 1, "{error}");
            assert!(error.to_string().contains(expected) && error.to_string().contains("night.toml:"), "{error}");
        }
    }

    #[test]
    fn a_scene_of_another_format_is_one_error() {
        for found in [FORMAT - 1, FORMAT + 1, 0, i64::MIN, i64::MAX] {
            let text = format!("bansho = {found}\n[[light]]\nno_key = 1\n[nothing]\n");
            let error = Scene::parse("other.toml", &text, &[]).err().expect("another format is refused");
            assert_eq!((error.problems.len(), error.omitted), (1, 0), "{error}");
            assert_eq!(error.problems[0].kind, ProblemKind::UnsupportedFormat { found, allowed: FORMAT });
        }
    }
}
