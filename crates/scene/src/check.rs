//! What a scene must fulfill beyond the ranges of single parameters.

use bansho_base::{
    camera::{Lens, VERTICAL_FOV_DEG},
    math,
    parameters::{Auto, BuildError, Node, ProblemKind, Range, Reader, Span, Table, Value, nearest},
    phenomenon::kind::PhenomenonKind,
};

use super::{FORMAT, SHARED_TABLES, Scene, ValuePath, tables::picture::LightKind};
use bansho_environment::{ground::Ground, lamps::Lamps, sky::SkyBackdrop};

/// Checks that the format number is one that this program reads. Returns whether the rest is worth reading: in an older format, other keys
/// are valid, and each would be one more problem.
pub(super) fn format(root: &Table, reader: &mut Reader) -> bool {
    let Some(node) = root.get("bansho") else {
        let kind = ProblemKind::Conflict(format!("the scene must begin with `bansho = {FORMAT}`, its format version"));
        reader.report_at(Some(0..0), kind);
        return true;
    };
    reader.within("bansho", |reader| match node.value {
        Value::Integer(FORMAT) => {}
        Value::Integer(found) if found > FORMAT => {
            reader.report(node, ProblemKind::NewerFormat { found, known: FORMAT });
        }
        Value::Integer(found) => reader.report(node, ProblemKind::OlderFormat { found, known: FORMAT }),
        _ => {
            let found = node.value.type_name();
            reader.report(node, ProblemKind::WrongType { expected: format!("the format version, {FORMAT}"), found });
        }
    });
    !matches!(node.value, Value::Integer(found) if found < FORMAT)
}

/// Only shared tables and known kinds of phenomena may stand at the root.
pub(super) fn root_keys(root: &Table, kinds: &[PhenomenonKind], reader: &mut Reader) {
    let known: Vec<&str> = std::iter::once("bansho")
        .chain(SHARED_TABLES.iter().map(|table| table.key))
        .chain(kinds.iter().map(|kind| kind.key))
        .collect();
    for entry in &root.entries {
        if !known.contains(&entry.key.as_str()) {
            reader.report_with(Some(entry.key_span.clone()), || ProblemKind::UnknownKey {
                key: entry.key.clone(),
                nearest: nearest(&entry.key, known.iter().copied()).map(str::to_owned),
                allowed: known.iter().map(|&key| key.to_owned()).collect(),
            });
        }
    }
}

/// Name of the plate's own layer.
pub const PLATE_LAYER: &str = "plate";

/// Names of layers that the scene itself has, which no phenomenon may take.
const RESERVED_NAMES: [&str; 4] = [PLATE_LAYER, SkyBackdrop::NAME, Ground::NAME, Lamps::NAME];

/// Names that programs give the channels and layers of the picture itself. A layer `Z` or `RGBA` makes OpenEXR's Python refuse a file;
/// `Combined`, `Alpha` and `Depth` take the place of the picture's own in Blender, `rgba`, `alpha` and `depth` are what Nuke calls them.
const NAMES_OF_READERS: [&str; 18] = [
    "R", "G", "B", "A", "X", "Y", "Z", "U", "V", "W", "RGB", "RGBA", "rgba", "Alpha", "alpha", "Depth", "depth",
    "Combined",
];

/// Longest name of a phenomenon, bytes: Blender cuts the names of layers after as many, without what follows the dot.
const LONGEST_NAME: usize = 63;

/// A name becomes the name of EXR layers, so it may hold no dot and no control characters, and must be one that readers keep.
pub(super) fn name(node: &Node, reader: &mut Reader) -> Option<String> {
    let Value::Text(name) = &node.value else {
        let expected = format!("a name of {}", allowed_names());
        reader.report(node, ProblemKind::WrongType { expected, found: node.value.type_name() });
        return None;
    };
    match name_fault(name) {
        None => Some(name.clone()),
        Some(reason) => {
            reader.report(node, ProblemKind::Conflict(reason));
            None
        }
    }
}

fn allowed_names() -> String {
    let reserved = RESERVED_NAMES.join(", ");
    format!("1 to {LONGEST_NAME} bytes of text without dots and control characters, and none of {reserved}")
}

/// Why a phenomenon cannot be called so.
fn name_fault(name: &str) -> Option<String> {
    let is_control_or_dot = |character: char| character == '.' || character.is_control();
    if NAMES_OF_READERS.contains(&name) {
        let others = NAMES_OF_READERS.join(", ");
        let fault = "cannot be a name, since programs that read EXR files take such a layer for the picture itself";
        return Some(format!("{fault}; allowed: any but {others}"));
    }
    if name.len() > LONGEST_NAME {
        let fault = format!("is a name of {} bytes, which programs that read EXR files would cut", name.len());
        return Some(format!("{fault}; allowed: {}", allowed_names()));
    }
    if name.trim().is_empty() || RESERVED_NAMES.contains(&name) || name.contains(is_control_or_dot) {
        let fault = "cannot be a name, which begins the names of EXR channels";
        return Some(format!("{fault}; allowed: {}", allowed_names()));
    }
    None
}

/// What the values of several parameters say together.
pub(super) fn values(scene: &Scene, root: &Table, reader: &mut Reader) {
    camera(scene, root, reader);
    lights(scene, root, reader);
    plate(scene, root, reader);
}

/// Reports to `reader` an error of what was built from the table at the dotted `path` of the scene `root`, at the position of its key.
pub fn report_build_error(fault: BuildError, path: String, root: &Table, reader: &mut Reader) {
    let place = place(root, &format!("{path}.{}", fault.key));
    reader.within(path, |reader| {
        reader.within(fault.key, |reader| reader.report_at(place, fault.kind));
    });
}

/// A camera must look somewhere.
fn camera(scene: &Scene, root: &Table, reader: &mut Reader) {
    let [position, target] = [&scene.camera.position, &scene.camera.target].map(|place| place.at(0.0));
    if position == target {
        let kind = ProblemKind::Conflict("lies where the camera stands; allowed: any other place".into());
        let place = place(root, "camera.target");
        reader.within("camera", |r| r.within("target", |r| r.report_at(place, kind)));
    }
    field_of_view(scene, root, reader);
}

/// The field of view that follows from focal length and sensor is within the same limits as one that is stated.
fn field_of_view(scene: &Scene, root: &Table, reader: &mut Reader) {
    let (camera, Range { min, max }) = (&scene.camera, VERTICAL_FOV_DEG);
    if camera.lens != Lens::Perspective {
        return;
    }
    let Some([narrowest, widest]) = camera.fov_of_focal_length() else { return };
    // The limits themselves are met but for rounding.
    let is_allowed = |fov: f64| (min * (1.0 - 1e-9)..=max * (1.0 + 1e-9)).contains(&fov);
    let Some(fov) = [widest, narrowest].into_iter().find(|fov| !is_allowed(*fov)) else { return };
    let sensor = camera.sensor_height_mm;
    let focal = |fov: f64| 0.5 * sensor / math::tan(0.5 * fov.to_radians());
    let reason = format!(
        "gives a field of view of {fov:.3} degrees with a sensor of {sensor} mm; allowed: {min} to {max} degrees, here {:.3} to {:.0} mm",
        focal(max),
        focal(min)
    );
    report_build_error(
        BuildError { key: "focal_length_mm".into(), kind: ProblemKind::Conflict(reason) },
        "camera".into(),
        root,
        reader,
    );
}

/// A lamp that shines somewhere must say where to, and a spot be full within the angle at which it ends. A fullness that the file does not
/// state ends with the spot.
fn lights(scene: &Scene, root: &Table, reader: &mut Reader) {
    for (index, light) in scene.lights.iter().enumerate() {
        let path = format!("light.{index}");
        let fault = |key: &str, text| BuildError { key: key.into(), kind: ProblemKind::Conflict(text) };
        if light.is_directed() && !light.has_direction() {
            let reason = "is no direction; allowed: any three numbers that are not all 0".to_owned();
            report_build_error(fault("direction", reason), path.clone(), root, reader);
        }
        let stated = ValuePath::root().key("light").index(index).key("inner_cone_deg").find(root).is_some();
        if light.kind == LightKind::Spot && stated && light.inner_cone_deg > light.outer_cone_deg {
            let reason = format!(
                "a spot that is full up to {} degrees cannot be dark beyond {}; allowed: up to `outer_cone_deg`",
                light.inner_cone_deg, light.outer_cone_deg
            );
            report_build_error(fault("inner_cone_deg", reason), path, root, reader);
        }
    }
}

/// What belongs to a plate needs one.
fn plate(scene: &Scene, root: &Table, reader: &mut Reader) {
    if scene.plate.image.is_none() && scene.plate.depth.is_some() {
        let place = place(root, "plate.depth");
        let kind = ProblemKind::Conflict("a depth needs an `image` that it belongs to".into());
        reader.within("plate", |r| r.within("depth", |r| r.report_at(place, kind)));
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

/// Where the value at a dotted path stands, or the nearest part of it that the file states.
pub(super) fn place(root: &Table, path: &str) -> Option<Span> {
    let mut value = None;
    let mut span = None;
    for segment in path.split('.') {
        let node = match value.unwrap_or(&Value::Bool(false)) {
            _ if value.is_none() => root.get(segment),
            Value::Table(table) => table.get(segment),
            Value::List(items) => segment.parse::<usize>().ok().and_then(|index| items.get(index)),
            _ => None,
        };
        let Some(node) = node else { break };
        span = Some(node.span.clone());
        value = Some(&node.value);
    }
    span
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_of_an_older_format_is_one_error() {
        let text = format!("bansho = {}\n[[light]]\nno_key = 1\n[nothing]\n", FORMAT - 1);
        let error = Scene::parse("old.toml", &text, &[]).err().expect("an old scene is refused");
        assert_eq!((error.problems.len(), error.omitted), (1, 0));
        assert!(error.to_string().contains("`bansho upgrade` rewrites the file"), "{error}");
    }
}
