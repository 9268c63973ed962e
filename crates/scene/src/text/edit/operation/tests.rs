use bansho_base::parameters::Table as Values;

use super::*;

const SCENE: &str = "\
# What it shows.
bansho = 2

[wind] # from the left
velocity = [0.5, 0, 0] # m/s

[[flame_sheet]]
name = \"left log\"
height = 0.8 # low
sparks = { rate = 3.0 }

# behind it
[[flame_sheet]]
name = \"right log\"
";

fn at(path: &str) -> ValuePath {
    path.split('.').fold(ValuePath::root(), |path, segment| match segment.parse() {
        Ok(index) => path.index(index),
        Err(_) => path.key(segment),
    })
}

fn set_to(path: &str, value: Value) -> Operation {
    Operation::Set { path: at(path), value }
}

fn keyframe(path: &str, time: f64, value: f64) -> Operation {
    Operation::SetKeyframe { path: at(path), time, value: Value::Number(value) }
}

fn lines_that_differ<'a>(before: &'a str, after: &'a str) -> Vec<&'a str> {
    after.lines().filter(|line| !before.lines().any(|old| old == *line)).collect()
}

#[test]
fn a_value_changes_and_nothing_else_does() {
    let text = apply(SCENE, &[set_to("flame_sheet.0.height", Value::Number(1.25))]).unwrap();
    assert_eq!(lines_that_differ(SCENE, &text), ["height = 1.25 # low"]);
    assert_eq!(text.lines().count(), SCENE.lines().count());
}

#[test]
fn values_of_inner_tables_and_lists_change_in_place() {
    let operations =
        [set_to("flame_sheet.0.sparks.rate", Value::Number(9.0)), set_to("wind.velocity.2", Value::Number(-1.0))];
    let text = apply(SCENE, &operations).unwrap();
    assert_eq!(lines_that_differ(SCENE, &text), ["velocity = [0.5, 0, -1.0] # m/s", "sparks = { rate = 9.0 }"]);
}

#[test]
fn the_first_item_of_a_missing_list_is_created() {
    let operations = [keyframe("flame_sheet.1.instances.0.rotation_y_deg", 0.5, 3.0)];
    let text = apply(SCENE, &operations).unwrap();
    let made = "instances = [{ rotation_y_deg = { keys = [[0.5, 3.0]] } }]";
    assert_eq!(lines_that_differ(SCENE, &text), [made]);
    assert!(apply(SCENE, &[set_to("flame_sheet.1.instances.1.position", Value::Number(0.0))]).is_err());
}

#[test]
fn missing_tables_are_created() {
    let operations =
        [set_to("picture.frames", Value::Integer(9)), set_to("flame_sheet.1.smoke.optical_depth", Value::Number(0.4))];
    let text = apply(SCENE, &operations).unwrap();
    assert!(text.contains("[picture]\nframes = 9"), "{text}");
    assert!(text.contains("smoke = { optical_depth = 0.4 }"), "{text}");
}

#[test]
fn a_table_of_the_scene_gets_a_header_also_if_it_is_empty_and_stays_in_its_place() {
    let text = apply(SCENE, &[set_to("fog", Value::Table(Values::default()))]).unwrap();
    assert_eq!(text, format!("{SCENE}\n[fog]\n"));
    let mut wind = Values::default();
    wind.push("gust", Value::Number(0.5));
    let text = apply(SCENE, &[set_to("wind", Value::Table(wind))]).unwrap();
    assert!(text.contains("bansho = 2\n\n[wind] # from the left\ngust = 0.5\n\n[[flame_sheet]]"), "{text}");
}

#[test]
fn removing_a_value_keeps_everything_else() {
    let text = apply(SCENE, &[Operation::Remove { path: at("flame_sheet.0") }]).unwrap();
    assert!(!text.contains("left log") && text.contains("# behind it") && text.contains("# from the left"), "{text}");
    let text = apply(SCENE, &[Operation::Remove { path: at("flame_sheet.0.height") }]).unwrap();
    assert_eq!(text.lines().count(), SCENE.lines().count() - 1);
}

#[test]
fn items_get_headers_at_the_root_and_are_inline_within() {
    let mut rain = Values::default();
    rain.push("name", Value::Text("shower".into()));
    let burner = |diameter: f64| {
        let mut burner = Values::default();
        burner.push("diameter", Value::Number(diameter));
        Operation::Append { path: at("flame_particles.0.burners"), value: Value::Table(burner) }
    };
    let operations = [
        Operation::Append { path: at("rain"), value: Value::Table(rain) },
        Operation::Append { path: at("flame_particles"), value: Value::Table(Values::default()) },
        burner(0.5),
        burner(0.25),
    ];
    let text = apply(SCENE, &operations).unwrap();
    assert!(text.ends_with(
        "\n\n[[rain]]\nname = \"shower\"\n\n[[flame_particles]]\nburners = [{ diameter = 0.5 }, { diameter = 0.25 }]\n"
    ), "{text}");
}

#[test]
fn tables_that_contain_tables_get_headers_within_one_that_has() {
    let mut sheet = Values::default();
    sheet.push("scale", Value::Number(2.0));
    let mut shape = Values::default();
    shape.push("sheets", Value::List(vec![Value::Table(sheet).into()]));
    let shape = Operation::Append { path: at("aurora.0.shapes"), value: Value::Table(shape) };
    let aurora = Operation::Append { path: at("aurora"), value: Value::Table(Values::default()) };
    let text = apply("bansho = 2\n", &[aurora, shape.clone(), shape]).unwrap();
    let shape = "\n[[aurora.shapes]]\nsheets = [{ scale = 2.0 }]\n";
    assert_eq!(text, format!("bansho = 2\n\n[[aurora]]\n{shape}{shape}"));
}

#[test]
fn keyframes_are_sorted_replaced_and_removed() {
    let mut text = apply(SCENE, &[keyframe("flame_sheet.0.height", 2.0, 1.0)]).unwrap();
    assert!(text.contains("height = { keys = [[2.0, 1.0]] } # low"), "{text}");
    text = apply(&text, &[keyframe("flame_sheet.0.height", 4.0, 3.0), keyframe("flame_sheet.0.height", 0.0, 0.5)])
        .unwrap();
    assert!(text.contains("keys = [[0.0, 0.5], [2.0, 1.0], [4.0, 3.0]]"), "{text}");
    text = apply(&text, &[keyframe("flame_sheet.0.height", 2.000_000_1, 1.5)]).unwrap();
    assert!(text.contains("keys = [[0.0, 0.5], [2.0, 1.5], [4.0, 3.0]]"), "{text}");
    let remove = |time| Operation::RemoveKeyframe { path: at("flame_sheet.0.height"), time };
    text = apply(&text, &[remove(0.0), remove(4.0)]).unwrap();
    assert!(text.contains("keys = [[2.0, 1.5]]"), "{text}");
    text = apply(&text, &[remove(2.0)]).unwrap();
    assert!(text.contains("height = 1.5 # low"), "{text}");
}

#[test]
fn missing_paths_are_refused_and_nothing_is_changed() {
    let remove = |path: &str| Operation::Remove { path: at(path) };
    for path in ["flame_sheet.7", "flame_sheet.0.nothing", "wind.velocity.5", "rain.0.x", "bansho.0"] {
        assert!(matches!(apply(SCENE, &[remove(path)]), Err(EditError::NoSuchPath { .. })), "{path}");
    }
    let missing_key = Operation::RemoveKeyframe { path: at("wind.velocity"), time: 1.0 };
    assert!(matches!(apply(SCENE, &[missing_key]), Err(EditError::NoKeyframe { .. })));
    let not_finite = set_to("wind.gust", Value::List(vec![Value::Text("a".into()).into()]));
    assert!(apply(SCENE, &[not_finite]).is_ok(), "types are checked by the scene");
    assert!(matches!(apply("= 3", &[]), Err(EditError::Syntax(_))));
}

#[test]
fn paths_find_the_values_of_the_reader() {
    let root = crate::parse_values(SCENE).unwrap();
    assert_eq!(at("flame_sheet.0.sparks.rate").find(&root).unwrap().value, Value::Number(3.0));
    assert_eq!(at("wind.velocity.0").find(&root).unwrap().value, Value::Number(0.5));
    assert!(at("flame_sheet.2").find(&root).is_none() && ValuePath::root().find(&root).is_none());
    assert_eq!(at("flame_sheet.0.sparks.rate").to_string(), "flame_sheet.0.sparks.rate");
}

#[test]
fn comments_stay_with_the_items_of_a_list() {
    let scene = "burners = [\n  # by the wall\n  1, # one\n  2, # two\n  3, # three\n]\n";
    let without = |index: usize| apply(scene, &[Operation::Remove { path: at(&format!("burners.{index}")) }]).unwrap();
    assert_eq!(without(0), "burners = [\n  2, # two\n  3, # three\n]\n");
    assert_eq!(without(1), "burners = [\n  # by the wall\n  1, # one\n  3, # three\n]\n");
    assert_eq!(without(2), "burners = [\n  # by the wall\n  1, # one\n  2, # two\n]\n");
    let added = apply(scene, &[Operation::Append { path: at("burners"), value: Value::Integer(4) }]).unwrap();
    assert_eq!(added, "burners = [\n  # by the wall\n  1, # one\n  2, # two\n  3, # three\n  4,\n]\n");
    let line = apply("a = [1, 2]\n", &[Operation::Append { path: at("a"), value: Value::Integer(3) }]).unwrap();
    assert_eq!(line, "a = [1, 2, 3]\n");
}
