//! Rewriting a scene of an older format in the current one.

use toml_edit::{InlineTable, Item, Key, Table, TableLike, Value};

use super::document::{EditError, check_edited, parse_document, replace_value};
use crate::FORMAT;

/// Old names with their new names.
type Renames = &'static [(&'static str, &'static str)];

/// Keys of format 1 that format 2 renames, by the path of their table. All paths here are those of format 1.
const RENAMED_KEYS: &[(&str, Renames)] = &[
    ("ground", &[("colour", "color")]),
    ("light", &[("colour", "color"), ("inner_deg", "inner_cone_deg"), ("outer_deg", "outer_cone_deg")]),
    ("flame_sheet", &[("turn_deg", "yaw_deg"), ("colour", "color")]),
    ("flame_sheet.sparks", &[("spread", "speed_variation"), ("life_s", "lifetime_s"), ("size", "diameter")]),
    ("flame_sheet.smoke", &[("colour", "color"), ("start", "base_height")]),
    ("flame_sheet.instances", &[("turn_deg", "yaw_deg")]),
    (
        "flame_particles.fluid",
        &[
            ("support", "support_radius"),
            ("force_kernel", "pressure_kernel"),
            ("tension", "negative_pressure"),
            ("sub_steps", "max_substeps"),
        ],
    ),
    ("flame_particles", &[("motion", "forces"), ("life", "combustion"), ("look", "rendering")]),
    (
        "flame_particles.motion",
        &[("wind", "wind_model"), ("wind_gain", "wind_response"), ("narrowing", "plume_contraction")],
    ),
    (
        "flame_particles.life",
        &[
            ("temperature", "temperature_model"),
            ("heating_s", "heating_time_s"),
            ("air_hunger", "oxygen_dependence"),
            ("smoke", "smoke_fraction"),
            ("radiation", "radiative_cooling"),
            ("afterlife_s", "burnt_gas_lifetime_s"),
        ],
    ),
    ("flame_particles.look", &[("haze_gain", "heat_haze_gain")]),
    ("flame_particles.look.sparks", &[("spread", "speed_variation"), ("life_s", "lifetime_s"), ("size", "diameter")]),
    ("rain", &[("velocity", "terminal_velocity"), ("veil_distance", "airlight_distance")]),
    ("rain.splashes", &[("amount", "fraction"), ("speed", "speed_scale")]),
    ("aurora.shapes", &[("after_s", "transition_s"), ("after_frames", "transition_frames")]),
    (
        "aurora.shapes.sheets",
        &[
            ("path", "svg_file"),
            ("stroke", "svg_path_id"),
            ("count", "wave_count"),
            ("flux", "flux_factor"),
            ("fade", "end_taper"),
            ("energy", "energy_factor"),
        ],
    ),
    ("aurora.shapes.split", &[("at", "length_fraction")]),
    ("aurora.shapes.merge", &[("at", "ends")]),
    ("aurora.shapes.link", &[("at", "from_length_fraction"), ("arrives", "to_length_fraction")]),
    ("aurora", &[("motion", "morphing"), ("drawing", "rendering")]),
    ("aurora.motion", &[("spacing", "control_point_spacing"), ("renew_frames", "update_interval_frames")]),
    (
        "aurora.field",
        &[
            ("reach_km", "screening_length_km"),
            ("pull", "attraction"),
            ("turn_deg_per_frame", "gyration_deg_per_frame"),
            ("noise_life_s", "noise_correlation_time_s"),
        ],
    ),
    ("aurora.particles", &[("pull_weight", "lorentz_weight"), ("neighbours", "neighbor_count")]),
    (
        "aurora.particles.relocation",
        &[
            ("count", "scatter_count_threshold"),
            ("potential", "potential_threshold"),
            ("births_at_most", "max_births"),
            ("deaths_at_most", "max_deaths"),
            ("scaled", "scale_counts"),
        ],
    ),
    (
        "aurora.rays",
        &[
            ("scale_km", "spacing_km"),
            ("life_s", "lifetime_s"),
            ("energy", "energy_variation"),
            ("black_rays", "black_ray_depth"),
            ("black_scale_km", "black_ray_spacing_km"),
        ],
    ),
    ("aurora.folds", &[("scale_km", "wavelength_km"), ("life_s", "lifetime_s")]),
    ("aurora.pulsation", &[("depth", "modulation_depth"), ("patch_km", "patch_length_km")]),
    (
        "aurora.drawing",
        &[
            ("fall", "energy_deposition"),
            ("blur", "blur_space"),
            ("spread_km", "blur_radius_km"),
            ("wobble", "collision_deflection"),
            ("air", "extinction"),
        ],
    ),
    ("aurora.drawing.air", &[("angstrom", "angstrom_exponent")]),
];

/// Values of choices of format 1 that format 2 renames, by the path of their key.
const RENAMED_VALUES: &[(&str, Renames)] = &[
    ("flame_sheet.colour.kind", &[("paper", "rgb_curves")]),
    ("flame_sheet.stage", &[("coloured", "colored")]),
    ("flame_particles.burners.shape", &[("disc", "disk")]),
    ("flame_particles.motion.wind", &[("mixing", "entrainment"), ("per_volume", "body_force")]),
    ("flame_particles.fluid.tension", &[("unclamped", "allowed")]),
    ("flame_particles.life.temperature", &[("living", "simulated")]),
    ("flame_particles.look.sprite", &[("integral", "line_integral")]),
    ("rain.velocity", &[("measured", "gunn_kinzer"), ("formula", "rigid_sphere")]),
    ("aurora.spectrum", &[("arc", "gaussian"), ("single", "monoenergetic")]),
    ("aurora.field.charge", &[("even", "uniform")]),
    ("aurora.particles.kernel", &[("spline", "cubic_spline")]),
    ("aurora.drawing.fall", &[("fang", "fang_2010")]),
    ("aurora.drawing.blur", &[("km", "world"), ("pixels", "screen")]),
    ("aurora.drawing.sampling", &[("collisions", "single_collisions"), ("profile", "mean_profile")]),
];

/// Returns the text in the current format, `None` if it has it already.
///
/// Comments and the order of keys stay as they are. A text that does not state its format counts as format 1.
///
/// # Errors
/// The text is not TOML, or of a newer format.
pub fn upgrade(text: &str) -> Result<Option<String>, EditError> {
    let mut document = parse_document(text)?;
    match document.get("bansho").and_then(Item::as_integer) {
        Some(FORMAT) => return Ok(None),
        Some(found) if found > FORMAT => return Err(EditError::NewerFormat { found }),
        _ => {}
    }
    upgrade_table(document.as_table_mut(), "");
    let version = document.get_mut("bansho").and_then(Item::as_value_mut);
    let upgraded = if let Some(version) = version {
        replace_value(version, Value::from(FORMAT));
        document.to_string()
    } else {
        document.remove("bansho");
        format!("bansho = {FORMAT}\n{document}")
    };
    check_edited(&upgraded)?;
    Ok(Some(upgraded))
}

/// Upgrades everything in the table at `path`, then its own keys, so that paths are always those of the old format.
fn upgrade_table(table: &mut Table, path: &str) {
    for (key, item) in table.iter_mut() {
        let path = child_path(path, key.get());
        if has_changes(&path) {
            upgrade_item(item, &path);
        }
    }
    if let Some(keys) = renamed_keys(table, path) {
        let items: Vec<Item> = table.iter_mut().map(|(_, item)| std::mem::take(item)).collect();
        table.clear();
        for (key, item) in keys.iter().zip(items) {
            table.insert_formatted(key, item);
        }
    }
}

fn upgrade_inline_table(table: &mut InlineTable, path: &str) {
    for (key, value) in table.iter_mut() {
        let path = child_path(path, key.get());
        if has_changes(&path) {
            upgrade_value(value, &path);
        }
    }
    if let Some(keys) = renamed_keys(table, path) {
        let values: Vec<Value> = table.iter().map(|(_, value)| value.clone()).collect();
        table.clear();
        for (key, value) in keys.iter().zip(values) {
            table.insert_formatted(key, value);
        }
    }
}

fn upgrade_item(item: &mut Item, path: &str) {
    match item {
        Item::None => {}
        Item::Value(value) => upgrade_value(value, path),
        Item::Table(table) => upgrade_table(table, path),
        Item::ArrayOfTables(tables) => tables.iter_mut().for_each(|table| upgrade_table(table, path)),
    }
}

/// Upgrades a choice, an inline table, or an array of inline tables. Curves and keyframes have no path of their own and are not entered.
fn upgrade_value(value: &mut Value, path: &str) {
    match value {
        Value::InlineTable(table) => upgrade_inline_table(table, path),
        Value::Array(items) => {
            items.iter_mut().filter_map(Value::as_inline_table_mut).for_each(|table| upgrade_inline_table(table, path));
        }
        Value::String(name) => {
            if let Some(new) = new_name(renames(RENAMED_VALUES, path), name.value()) {
                replace_value(value, Value::from(new));
            }
        }
        _ => {}
    }
}

/// The keys of the table at `path` in their order, with new names and the old whitespace and comments; `None` if none has a new name.
/// A key keeps its old name where the table contains the new name as well: both cannot be kept, and the parser reports the unknown one.
fn renamed_keys(table: &dyn TableLike, path: &str) -> Option<Vec<Key>> {
    let renames = renames(RENAMED_KEYS, path);
    let new_key = |key: &str| new_name(renames, key).filter(|new| !table.contains_key(new));
    if !table.iter().any(|(key, _)| new_key(key).is_some()) {
        return None;
    }
    let renamed = |(key, _): (&str, &Item)| {
        let old = table.key(key).cloned().unwrap_or_else(|| Key::new(key));
        match new_key(key) {
            None => old,
            Some(new) => {
                Key::new(new).with_leaf_decor(old.leaf_decor().clone()).with_dotted_decor(old.dotted_decor().clone())
            }
        }
    };
    Some(table.iter().map(renamed).collect())
}

/// The renames at `path`; empty if there are none.
fn renames(all: &[(&str, Renames)], path: &str) -> Renames {
    all.iter().find(|(of, _)| *of == path).map_or(&[], |(_, renames)| renames)
}

fn new_name(renames: Renames, name: &str) -> Option<&'static str> {
    renames.iter().find(|(old, _)| *old == name).map(|(_, new)| *new)
}

/// Whether anything is renamed at `path` or below it.
fn has_changes(path: &str) -> bool {
    let is_within = |(of, _): &(&str, Renames)| {
        of.strip_prefix(path).is_some_and(|rest| matches!(rest.bytes().next(), None | Some(b'.')))
    };
    RENAMED_KEYS.iter().chain(RENAMED_VALUES).any(is_within)
}

fn child_path(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dotted path of format 1 in format 2.
    fn new_path(path: &str) -> String {
        let mut table = String::new();
        let mut new = String::new();
        for key in path.split('.') {
            new = child_path(&new, new_name(renames(RENAMED_KEYS, &table), key).unwrap_or(key));
            table = child_path(&table, key);
        }
        new
    }

    #[test]
    fn every_key_is_renamed() {
        let is_table =
            |path: &str| RENAMED_KEYS.iter().any(|(table, _)| table.starts_with(&format!("{path}.")) || *table == path);
        let all =
            RENAMED_KEYS.iter().flat_map(|(table, renames)| renames.iter().map(|(old, _)| child_path(table, old)));
        let leaves: Vec<String> = all.filter(|path| !is_table(path)).collect();
        let text = |path: &dyn Fn(&str) -> String| -> String {
            leaves.iter().map(|leaf| format!("# About {leaf}.\n{} = 0  # {leaf}\n", path(leaf))).collect()
        };
        let old = text(&|path| path.to_owned());
        let new = text(&|path| new_path(path));
        assert_eq!(upgrade(&format!("bansho = 1\n{old}")).unwrap().unwrap(), format!("bansho = 2\n{new}"));
        for (table, renames) in RENAMED_KEYS {
            for (old, renamed) in *renames {
                assert!(new_path(&child_path(table, old)).ends_with(&format!(".{renamed}")), "{table}.{old}");
            }
        }
    }

    #[test]
    fn every_value_is_renamed() {
        for (path, renames) in RENAMED_VALUES {
            for (old, new) in *renames {
                let upgraded = upgrade(&format!("bansho = 1\n{path} = \"{old}\" # why\n")).unwrap().unwrap();
                assert_eq!(upgraded, format!("bansho = 2\n{} = \"{new}\" # why\n", new_path(path)));
            }
        }
    }

    #[test]
    fn order_comments_and_spaces_stay() {
        let old = r#"# A scene.

bansho = 1   # format version

[[light]]
# How warm.
colour   = [1, 1, 1]   # white
outer_deg = 40
inner_deg = 20 # less

# Flames.
[[flame_particles]]
name = "left" # not "disc"
burners = [
    { shape = "disc", diameter = 0.3 }, # round
    { shape = "point" },
]
look.haze_gain = 2
look.sparks = { rate = 3, spread = 0.1, life_s = 2 }

[flame_particles.life] # burning
smoke = 0.1
temperature = "living"

# Another.
[[flame_particles]]
[flame_particles.motion]
wind = "mixing"

[[aurora]]
time_lapse = 2
energy_ev = { keys = [[0, 500], [1, 600]], interpolation = "linear" }
[[aurora.shapes]]
after_s = 2
sheets = [{ form = "arc", flux = { points = [[0, 1], [1, 2]] }, fade = 0.1 }]
link = [{ from = 1, at = 0.2, arrives = 0.3 }]
[[aurora.shapes]]
[[aurora.shapes.sheets]]
path = "a.svg"
[[aurora.shapes.merge]]
at = "auto"
[aurora.drawing]
# The wide blur.
blur = "km"
[aurora.drawing.air]
angstrom = 1
# The end.
"#;
        let new = r#"# A scene.

bansho = 2   # format version

[[light]]
# How warm.
color   = [1, 1, 1]   # white
outer_cone_deg = 40
inner_cone_deg = 20 # less

# Flames.
[[flame_particles]]
name = "left" # not "disc"
burners = [
    { shape = "disk", diameter = 0.3 }, # round
    { shape = "point" },
]
rendering.heat_haze_gain = 2
rendering.sparks = { rate = 3, speed_variation = 0.1, lifetime_s = 2 }

[flame_particles.combustion] # burning
smoke_fraction = 0.1
temperature_model = "simulated"

# Another.
[[flame_particles]]
[flame_particles.forces]
wind_model = "entrainment"

[[aurora]]
time_lapse = 2
energy_ev = { keys = [[0, 500], [1, 600]], interpolation = "linear" }
[[aurora.shapes]]
transition_s = 2
sheets = [{ form = "arc", flux_factor = { points = [[0, 1], [1, 2]] }, end_taper = 0.1 }]
link = [{ from = 1, from_length_fraction = 0.2, to_length_fraction = 0.3 }]
[[aurora.shapes]]
[[aurora.shapes.sheets]]
svg_file = "a.svg"
[[aurora.shapes.merge]]
ends = "auto"
[aurora.rendering]
# The wide blur.
blur_space = "world"
[aurora.rendering.extinction]
angstrom_exponent = 1
# The end.
"#;
        assert_eq!(upgrade(old).unwrap().unwrap(), new);
        assert_eq!(upgrade(new), Ok(None));
    }

    #[test]
    fn a_text_without_its_format_counts_as_format_1() {
        let upgraded = upgrade("# A lake.\nground = { colour = [0, 0, 0] }\n").unwrap().unwrap();
        assert_eq!(upgraded, "bansho = 2\n# A lake.\nground = { color = [0, 0, 0] }\n");
        assert_eq!(upgrade("").unwrap().unwrap(), "bansho = 2\n");
        assert_eq!(upgrade("[bansho]\nx = 1\n").unwrap().unwrap(), "bansho = 2\n");
    }

    #[test]
    fn the_same_word_elsewhere_stays() {
        let text = "[wind]\nspeed = 2\ncolour = 1\n[[rain]]\ncolour = 1\nspread = 2\nlight = { colour = 1 }\n";
        assert_eq!(upgrade(&format!("bansho = 1\n{text}")).unwrap().unwrap(), format!("bansho = 2\n{text}"));
    }

    #[test]
    fn a_key_keeps_its_old_name_beside_the_new_one() {
        let text = "[[light]]\ncolor = 1\ncolour = 2\n";
        assert_eq!(upgrade(&format!("bansho = 1\n{text}")).unwrap().unwrap(), format!("bansho = 2\n{text}"));
    }

    #[test]
    fn a_newer_format_is_an_error() {
        assert_eq!(upgrade("bansho = 3\n"), Err(EditError::NewerFormat { found: 3 }));
    }
}
