//! Scene files: errors have positions and state what is allowed.

use bansho_base::{
    host::assets::MemoryAssets,
    math::random::{Key, Purpose, uniform},
    parameters::{self, Kind, PAPER_HEADING, TableDescriptor, Value},
    tables,
};
use bansho_render::PlanOptions;
use bansho_scene::{schema, template};

use crate::support::*;

/// The one problem of a scene, as a person reads it.
fn fault(text: &str) -> String {
    let compiled = compiled("test.toml", text, &kinds(), MemoryAssets::default());
    let error = compiled.err().unwrap_or_else(|| panic!("accepted: {text}"));
    assert_eq!(error.problems.len(), 1, "one fault, one error: {error}");
    error.to_string()
}

#[test]
fn faults_name_their_place_and_what_is_allowed() {
    for (text, expected) in [
        (
            "bansho = 2\n[picture]\nexposre_ev100 = 3\n",
            "test.toml:3:1: picture: unknown key `exposre_ev100`, \
          did you mean `exposure_ev100`?",
        ),
        ("bansho = 2\n[pictre]\n", "test.toml:2:2: unknown key `pictre`, did you mean `picture`?"),
        (
            "bansho = 2\n[picture]\nsize = \"big\"\n",
            "test.toml:3:8: picture.size: expected a list of 2 numbers from 1 to 16384, \
          found a string",
        ),
        (
            "bansho = 2\n[picture]\nsize = [0, 100]\n",
            "test.toml:3:9: picture.size: 0 is out of range; allowed: 1 to 16384 pixels",
        ),
        ("bansho = 2\n[picture]\nsize = [100, 1000000000]\n", "1000000000 is out of range; allowed: 1 to 16384 pixels"),
        ("bansho = 2\n[picture]\nsize = [100]\n", "has 1 item; allowed: exactly 2 items"),
        ("bansho = 2\n[picture]\nfps = \"24000/0\"\n", "inf is out of range; allowed: 0.1 to 1000"),
        ("bansho = 2\n[picture]\nfps = \"fast\"\n", "or a fraction such as \"24000/1001\", found a string"),
        (
            "bansho = 2\n[picture]\nexposure_ev100 = \"bright\"\n",
            "expected \"auto\" or a number from -40 to 40, found a string",
        ),
        ("bansho = 2\n[picture]\nframes = 1.5\n", "expected a whole number from 1 to 10000000, found a number"),
        (
            "bansho = 2\n[camera]\nlens = \"fishey\"\n",
            "test.toml:3:8: camera.lens: unknown value `fishey`, did you mean `fisheye`?; \
          allowed: perspective, fisheye, panorama",
        ),
        (
            "bansho = 2\n[wind]\nvelocity = { keys = [[1, [0, 0, 0]], [1, [1, 0, 0]]] }\n",
            "wind.velocity: point 2 is not after point 1",
        ),
        ("bansho = 2\n[wind]\nvelocity = { kes = [] }\n", "unknown key `kes`, did you mean `keys`?"),
        ("bansho = 2\n[wind]\nvelocity = nan\n", "expected a list of 3 numbers"),
        ("bansho = 2\n[wind]\ngust = nan\n", "NaN is out of range; allowed: 0 to 2"),
        ("bansho = 2\n[emitter]\n", "expected tables [[emitter]], with double brackets"),
        (
            "bansho = 2\n[[emitter]]\nradius = -1\n",
            "test.toml:3:10: emitter.0.radius: -1 is out of range; allowed: 0 to 100 m",
        ),
        (
            "bansho = 2\n[[emitter]]\nname = \"a\"\n[[absorber]]\nname = \"a\"\n",
            "test.toml:5:8: absorber.0: another phenomenon is already called \"a\"",
        ),
        ("bansho = 2\n[[emitter]]\nname = 3\n", "name: expected a name of 1 to 63 bytes of text without dots"),
        ("bansho = 2\n[picture]\nfps = nan\n", "test.toml:3:7: picture.fps: NaN is out of range; allowed: 0.1 to 1000"),
        (
            "bansho = 2\n[[light]]\nkind = \"spot\"\ndirection = [0, 0, 0]\n",
            "test.toml:4:13: light.0.direction: is the zero vector; allowed: ",
        ),
        (
            "bansho = 2\n[[light]]\nkind = \"spot\"\ninner_cone_deg = 80\nouter_cone_deg = 10\n",
            "test.toml:4:18: light.0.inner_cone_deg: 80 degrees is wider than `outer_cone_deg` (10); allowed: ",
        ),
        (
            "bansho = 2\n[[emitter]]\nname = \"a.b\"\n",
            "cannot be a name, since the names of EXR channels begin with it; allowed: 1 to 63 bytes of text without dots",
        ),
        (
            "bansho = 2\n[[emitter]]\nname = \"Z\"\n",
            "test.toml:3:8: emitter.0.name: cannot be a name, since programs that read EXR files take such a layer for the picture itself; \
             allowed: any but R, G, B, ",
        ),
        (
            "bansho = 2\n[[emitter]]\nname = \"ein Nordlicht über dem Fjord, gesehen vom Ufer gegenüber im Mai\"\n",
            "is a name of 65 bytes, which programs that read EXR files would truncate; allowed: 1 to 63 bytes",
        ),
        ("bansho = 2\n[[absorber]]\nnear = 2\nfar = 1\n", "test.toml:4:7: absorber.0.far: must lie behind `near`"),
        ("bansho = 2\n[plate]\nimage = \"gone.png\"\n", "test.toml:3:9: plate.image: gone.png: no such file"),
        (
            "bansho = 2\n[air]\ntemperature_k = 0\n",
            "test.toml:3:17: air.temperature_k: 0 is out of range; allowed: 150 to 400 K",
        ),
        ("bansho = 2\n[obstacle]\n", "expected tables [[obstacle]], with double brackets"),
        (
            "bansho = 2\n[[obstacle]]\nradius = 1\n[[obstacle]]\nshape = \"mesh\"\n",
            "obstacle.1.file (obstacle 2): an obstacle of shape \"mesh\" needs a `file`",
        ),
        (
            "bansho = 2\n[[obstacle]]\nshape = \"mesh\"\nfile = \"gone.glb\"\n",
            "test.toml:4:8: obstacle.0.file: gone.glb: no such file",
        ),
        ("bansho = 3\n", "test.toml:1:10: bansho: format 3 cannot be read by this version; allowed: 2"),
        ("bansho = 1\n", "test.toml:1:10: bansho: format 1 cannot be read by this version; allowed: 2"),
        ("[picture]\n", "the scene must begin with `bansho = 2`"),
        ("bansho = 2\n[picture\n", "test.toml:2:"),
        ("", "the scene must begin with `bansho = 2`"),
    ] {
        let shown = fault(text);
        assert!(shown.contains(expected), "{text}\nexpected: {expected}\nshown: {shown}");
    }
}

#[test]
fn faults_of_a_particle_flame_are_located() {
    let fault = |body: &str| {
        let text = format!("bansho = 2\n[[flame_particles]]\n{body}");
        let scene = compiled("test.toml", &text, bansho::KINDS, MemoryAssets::default());
        scene.err().unwrap_or_else(|| panic!("accepted: {text}")).to_string()
    };
    for (body, expected) in [
        ("particles = 100000000\n", "test.toml:3:13: flame_particles.0.particles: 100000000 particles would take"),
        (
            "combustion = { flame_temperature_k = 0 }\n",
            "combustion.flame_temperature_k: 0 is out of range; allowed: 250 to 4000 K",
        ),
        ("combustion = { flame_temperature_k = 1e6 }\n", "1000000 is out of range"),
        (
            "burners = [{}, { position = [0, 99, 0] }]\ndomain_max = [5, 5, 5]\n",
            "test.toml:3:29: flame_particles.0.burners.1.position (burner 2): the burner is at",
        ),
        ("burners = [{ shape = \"mesh\" }]\n", "burners.0.file (burner 1): a burner of shape \"mesh\" needs a `file`"),
        (
            "burners = [{ shape = \"mesh\", file = \"gone.glb\" }]\n",
            "test.toml:3:37: flame_particles.0.burners.0.file (burner 1): gone.glb: no such file",
        ),
        (
            "particles = 3\nburners = [{ diameter = 0.015 }]\ndomain_min = [-0.01, -0.01, -0.01]\ndomain_max = [0.01, 0.01, 0.01]\n",
            "particles: the support radius d would be",
        ),
    ] {
        let shown = fault(body);
        assert!(shown.contains(expected), "{body}\nexpected: {expected}\nshown: {shown}");
    }
}

#[test]
fn a_focal_length_is_held_to_the_field_of_view_that_may_be_stated() {
    let camera = |lines: &str| format!("bansho = 2\n[camera]\nsensor_height_mm = 51\n{lines}\n");
    let allowed = "allowed: 0.1 to 170 degrees, here 2.231 to 29221 mm";
    let shown = fault(&camera("focal_length_mm = 0.49"));
    assert!(shown.starts_with("test.toml:4:19: camera.focal_length_mm: gives a field of view of 177.79"), "{shown}");
    assert!(shown.contains(allowed), "{shown}");
    let keyed = fault(&camera("focal_length_mm = { keys = [[0, 35], [1, 2], [2, 35]] }"));
    assert!(keyed.contains("gives a field of view of 171.0") && keyed.contains(allowed), "{keyed}");
    let narrow = fault("bansho = 2\n[camera]\nsensor_height_mm = 0.1\nfocal_length_mm = 100\n");
    assert!(narrow.contains("allowed: 0.1 to 170 degrees"), "{narrow}");
    for lines in ["focal_length_mm = 2.24", "lens = \"fisheye\"\nfocal_length_mm = 0.49"] {
        parse(&camera(lines)).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn of_many_faults_the_first_are_listed_and_the_rest_counted() {
    let text = format!("bansho = 2\n{}", "[[absorber]]\nnear = -1\n".repeat(20_000));
    let error = parse(&text).err().unwrap();
    assert_eq!((error.problems.len(), error.omitted), (100, 19_900));
    let messages: Vec<String> = error.messages().collect();
    assert_eq!((messages.len(), error.omitted_message().as_deref()), (100, Some("test.toml: and 19900 more problems")));
    assert!(messages[99].starts_with("test.toml:201:8: absorber.99.near (absorber 100): "), "{}", messages[99]);
}

#[test]
fn names_are_compared_in_one_pass() {
    let text = format!("bansho = 2\n{}", "[[absorber]]\nname = \"mist\"\n".repeat(50_000));
    let error = parse(&text).err().unwrap();
    assert_eq!((error.problems.len(), error.omitted), (100, 49_899));
}

#[test]
fn two_faults_are_two_errors_in_the_order_of_the_file() {
    let text = "bansho = 2\n[camera]\nnear = 0\n[picture]\nframes = 0\n";
    let error = parse(text).err().unwrap();
    let paths: Vec<&str> = error.problems.iter().map(|problem| problem.path.as_str()).collect();
    assert_eq!(paths, ["camera.near", "picture.frames"]);
}

fn random(seed: u64) -> impl FnMut() -> f64 {
    let key = Key::new(seed, "random scene");
    let mut drawn = 0;
    move || {
        drawn += 1;
        f64::from(uniform(key.words(drawn, 0, Purpose(0))[0]))
    }
}

/// A random valid scene with a tiny picture.
fn random_scene(seed: u64) -> String {
    let mut uniform = random(seed);
    let mut text = String::from("bansho = 2\n");
    for shared in tables::shared(bansho::KINDS).filter(|shared| !["plate", "picture", "fog"].contains(&shared.key)) {
        let mut table = parameters::sample((shared.table)(), &mut uniform);
        // Random tables name no files, so no obstacle can be a mesh; a spot may not be full beyond its end.
        // Most random lenses are beyond the field of view that they may have.
        let left_out = [("obstacle", "shape"), ("light", "inner_cone_deg"), ("camera", "focal_length_mm")];
        table.entries.retain(|entry| !left_out.contains(&(shared.key, &entry.key)));
        text += &table_text(&shared.header(), &table);
    }
    for kind in phenomena() {
        let mut table = parameters::sample((kind.table)(), &mut uniform);
        table.entries.retain(|entry| !["near", "far", "preroll_s"].contains(&entry.key.as_str()));
        text += &table_text(&format!("[[{}]]", kind.key), &table);
    }
    if seed.is_multiple_of(4) {
        let fog = tables::find(bansho::KINDS, "fog").unwrap();
        text += &table_text(&fog.header(), &parameters::sample((fog.table)(), &mut uniform));
    }
    text + "[picture]\nsize = [17, 11]\n"
}

fn table_text(header: &str, table: &parameters::Table) -> String {
    let lines = table.entries.iter().map(|entry| format!("{} = {}\n", entry.key, entry.node.value));
    format!("{header}\n{}", lines.collect::<String>())
}

#[test]
fn random_valid_scenes_draw_finite_pictures() {
    for seed in 0..200 {
        let text = random_scene(seed);
        let frame = render(&text, &PlanOptions { layers: true, aovs: true, ..PlanOptions::default() }, 1);
        assert!(frame.beauty.pixels().iter().flatten().all(|value| value.is_finite()), "{text}");
    }
}

#[test]
fn what_a_scene_says_is_written_back_and_read_alike() {
    for seed in 0..200 {
        let text = random_scene(seed);
        let first = parse(&text).unwrap_or_else(|error| panic!("{error}"));
        let canonical: Vec<String> =
            first.instances.iter().map(|instance| Value::Table(instance.parameters.canonical()).to_string()).collect();
        let again = "bansho = 2\n".to_owned()
            + &first
                .instances
                .iter()
                .map(|instance| table_text(&format!("[[{}]]", instance.kind.key), &instance.parameters.canonical()))
                .collect::<String>();
        let second = parse(&again).unwrap_or_else(|error| panic!("{error}\n{again}"));
        let read: Vec<String> =
            second.instances.iter().map(|instance| Value::Table(instance.parameters.canonical()).to_string()).collect();
        assert_eq!(read, canonical);
    }
}

#[test]
fn every_default_lies_within_its_own_bounds_and_every_parameter_is_explained() {
    fn check(path: &str, table: &parameters::TableDescriptor) {
        for parameter in &table.parameters {
            let path = format!("{path}.{}", parameter.key);
            assert!(parameter.doc.len() > 5, "{path} is not explained");
            let inner = match &parameter.kind {
                Kind::Animated(inner) | Kind::Optional(inner) | Kind::Auto(inner) => inner.as_ref(),
                kind => kind,
            };
            match (inner, &parameter.default) {
                (Kind::Number { min, max }, Some(default)) => {
                    if let Some(number) = default.as_number() {
                        assert!((*min..=*max).contains(&number), "{path}: {number} is not from {min} to {max}");
                    }
                }
                (Kind::Table(inner), _) => check(&path, inner()),
                _ => {}
            }
        }
    }
    for kind in phenomena().iter().chain(bansho::KINDS) {
        check(kind.key, (kind.table)());
    }
}

#[test]
fn a_commented_template_is_a_valid_scene_also_when_every_line_is_uncommented() {
    let kinds: Vec<_> = bansho::KINDS.iter().copied().chain(phenomena()).collect();
    for kind in tables::phenomena(&kinds) {
        let text = template::commented(kind, &kinds);
        let parse = |text: &str| compiled("new.toml", text, &kinds, MemoryAssets::default()).map(drop);
        parse(&text).unwrap_or_else(|error| panic!("{error}"));
        let uncommented: String = text
            .lines()
            .map(|line| line.strip_prefix("# ").filter(|rest| rest.contains(" = ") && is_key(rest)).unwrap_or(line))
            .map(|line| format!("{line}\n"))
            .collect();
        parse(&uncommented).unwrap_or_else(|error| panic!("{error}\n{uncommented}"));
    }
}

/// The keys, at any depth, of the parameters of a table that are there only for a paper, and of all others: dotted, in the order of the template.
fn keys_by_purpose(prefix: &str, table: &TableDescriptor) -> [Vec<String>; 2] {
    let (mut for_pictures, mut for_paper) = (Vec::new(), Vec::new());
    for parameter in &table.parameters {
        let key = format!("{prefix}{}", parameter.key);
        match (&parameter.kind, parameter.is_for_paper) {
            (Kind::Table(inner), is_for_paper) => {
                let [mut pictures, mut paper] = keys_by_purpose(&format!("{key}."), inner());
                if is_for_paper { &mut for_paper } else { &mut for_pictures }.append(&mut pictures);
                for_paper.append(&mut paper);
            }
            (_, true) => for_paper.push(key),
            (_, false) => for_pictures.push(key),
        }
    }
    [for_pictures, for_paper]
}

#[test]
fn a_template_has_the_parameters_for_a_paper_last_below_their_heading() {
    for kind in bansho::phenomena() {
        let text = template::commented(kind, bansho::KINDS);
        let (_, own) = text.split_once(&format!("\n{}\n", kind.header())).unwrap();
        let [for_pictures, for_paper] = keys_by_purpose("", (kind.table)());
        // The volume flame follows no single paper.
        if kind.paper.is_none() {
            assert!(for_paper.is_empty() && !own.contains(PAPER_HEADING), "{}", kind.key);
            continue;
        }
        assert!(!for_paper.is_empty(), "{}", kind.key);
        let (before, after) = own.split_once(&format!("\n# {PAPER_HEADING}:\n")).expect(kind.key);
        for (keys, there, elsewhere) in [(&for_pictures, before, after), (&for_paper, after, before)] {
            for key in keys {
                let is_in = |text: &str| {
                    text.lines().any(|line| line.trim_start_matches("# ").starts_with(&format!("{key} =")))
                };
                assert!(is_in(there) && !is_in(elsewhere), "{}: {key}", kind.key);
            }
        }
    }
}

/// Whether the properties of a table, and of all tables in it, have those for a paper last.
fn check_order_of_properties(table: &TableDescriptor, schema: &serde_json::Value) {
    let properties = schema["properties"].as_object().unwrap();
    let order: Vec<&String> = properties.keys().filter(|key| !["name", "enabled"].contains(&key.as_str())).collect();
    let [for_pictures, for_paper] = table.by_purpose();
    let expected: Vec<&str> = for_pictures.iter().chain(&for_paper).map(|parameter| parameter.key).collect();
    // A table may have an `enabled` of its own.
    assert_eq!(order, expected.iter().filter(|key| **key != "enabled").copied().collect::<Vec<_>>());
    for parameter in &table.parameters {
        let property = &properties[parameter.key];
        let says_so = property["description"].as_str().unwrap_or_default().contains(PAPER_HEADING);
        assert_eq!(says_so, parameter.is_for_paper, "{}", parameter.key);
        match &parameter.kind {
            Kind::Table(inner) => check_order_of_properties(inner(), property),
            Kind::List { item, .. } if let Kind::Table(inner) = **item => {
                check_order_of_properties(inner(), &property["items"]);
            }
            _ => {}
        }
    }
}

#[test]
fn the_schema_has_the_parameters_for_a_paper_last_and_says_what_they_are() {
    let schema = schema::schema(bansho::KINDS);
    for kind in bansho::phenomena() {
        check_order_of_properties((kind.table)(), &schema["properties"][kind.key]["items"]);
    }
}

/// The tables that phenomena share, with their paths.
fn shared_tables(scene: &bansho_scene::Scene) -> Vec<(String, Value)> {
    let table =
        |(path, table): (String, &bansho_scene::SharedInstance)| (path, Value::Table(table.parameters.canonical()));
    scene.tables.with_paths().map(table).collect()
}

#[test]
fn a_template_states_all_scene_defaults_of_its_kind() {
    for kind in bansho::phenomena() {
        let parse = |text: &str| {
            let kinds = bansho::KINDS;
            let compiled = compiled("new.toml", text, kinds, MemoryAssets::default());
            compiled.unwrap_or_else(|error| panic!("{error}")).scene().clone()
        };
        let stated = parse(&format!("bansho = 2\n{}\n[[{}]]\n", kind.scene_defaults, kind.key));
        let new = parse(&template::commented(kind, bansho::KINDS));
        assert_eq!((&new.picture, &new.camera, &new.wind), (&stated.picture, &stated.camera, &stated.wind));
        assert_eq!(shared_tables(&new), shared_tables(&stated));
        assert_eq!(new.instances.len(), 1);
    }
}

#[test]
fn a_short_template_says_what_one_changes_first_and_is_the_same_scene() {
    let kinds = bansho::KINDS;
    for kind in bansho::phenomena() {
        let parse = |text: &str| {
            let compiled = compiled("new.toml", text, kinds, MemoryAssets::default());
            compiled.unwrap_or_else(|error| panic!("{error}\n{text}")).scene().clone()
        };
        let text = template::short(kind, kinds);
        let (short, long) = (parse(&text), parse(&template::commented(kind, bansho::KINDS)));
        assert_eq!((&short.picture, &short.camera, &short.wind), (&long.picture, &long.camera, &long.wind));
        assert_eq!(shared_tables(&short), shared_tables(&long));
        assert_eq!((&short.air, &short.plate), (&long.air, &long.plate));
        let count = text.lines().count();
        assert!((15..=40).contains(&count), "{count} lines:\n{text}");
        for key in ["size = ", "fps = ", "frames = ", "position = ", "target = ", "velocity = "] {
            assert!(text.contains(&format!("\n{key}")), "{key} is missing:\n{text}");
        }
        for key in kind.first_keys {
            let last = key.rsplit('.').next().unwrap();
            assert!(text.contains(&format!("{last} = ")), "{key} is missing:\n{text}");
        }
        // A list of several tables is explained above it.
        let is_listed = |line: &str| line.starts_with("    {") || line.ends_with(" = [");
        let mut stated = text.lines().filter(|line| line.contains(" = ") && !is_listed(line));
        assert!(stated.all(|line| line.contains("   # ")), "{text}");
        assert!(text.lines().all(|line| line.len() <= 140), "{text}");
    }
}

#[test]
fn a_models_fault_stays_what_it_is() {
    use bansho_base::parameters::ProblemKind;
    use bansho_fire::particles::ParticleErrorKind;
    let text = "bansho = 2\n[[flame_particles]]\nparticles = 900000000\n";
    let kinds = bansho::KINDS;
    let error = compiled("new.toml", text, kinds, MemoryAssets::default()).err().unwrap();
    let ProblemKind::Model(fault) = &error.problems[0].kind else { panic!("{error}") };
    let kind = fault.downcast::<ParticleErrorKind>();
    assert!(matches!(kind, Some(ParticleErrorKind::TooManyParticles { count: 900_000_000, .. })), "{error}");
}

#[test]
fn flames_together_may_not_have_more_particles_than_fit() {
    let flame = |count: i64, enabled: bool| format!("[[flame_particles]]\nparticles = {count}\nenabled = {enabled}\n");
    let check = |flames: [String; 3]| {
        let text = format!("bansho = 2\n{}", flames.concat());
        let kinds = bansho::KINDS;
        compiled("new.toml", &text, kinds, MemoryAssets::default()).err().map(|error| error.to_string())
    };
    let error = check([flame(12_000_000, true), flame(9_000_000, true), flame(8_000_000, true)]).unwrap();
    let expected = "9000000 particles in addition to 12000000 of other flames would take 13 GiB; allowed: up to ";
    assert!(error.contains("new.toml:6") && error.contains(expected), "{error}");
    // One that is off takes nothing.
    let error = check([flame(900_000, true), flame(20_000_000, false), flame(500_000, true)]).unwrap_or_default();
    assert!(!error.contains("beside"), "{error}");
}

fn is_key(line: &str) -> bool {
    let key = line.split(" = ").next().unwrap_or_default();
    key.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"_.".contains(&byte))
}

#[test]
fn the_schema_knows_every_parameter() {
    let schema = schema::schema(&kinds());
    assert_eq!(schema["properties"]["picture"]["properties"]["size"]["maxItems"], 2);
    assert_eq!(schema["properties"]["camera"]["properties"]["lens"]["enum"][1], "fisheye");
    assert_eq!(schema["properties"]["emitter"]["items"]["properties"]["radius"]["minimum"], 0.0);
    assert!(schema["properties"]["wind"]["properties"]["velocity"]["anyOf"][1]["properties"]["keys"].is_object());
    // A name has no dots, as the parser says; the parser refuses what the schema lists.
    let name = &schema["properties"]["emitter"]["items"]["properties"]["name"];
    assert!(name["pattern"].as_str().unwrap().starts_with("^[^.") && name["maxLength"] == 63, "{name}");
    let refused: Vec<&str> = name["not"]["enum"].as_array().unwrap().iter().map(|own| own.as_str().unwrap()).collect();
    assert!(refused.contains(&"plate") && refused.contains(&"RGBA"));
    for name in refused.into_iter().chain(["left.log", " ", "", "a\\u0007b"]) {
        assert!(fault(&format!("bansho = 2\n[[emitter]]\nname = \"{name}\"\n")).contains("allowed: "), "{name}");
    }
}

#[test]
fn a_plate_of_another_shape_than_its_depth_is_refused() {
    use bansho_base::{
        host::assets::{Encoding, Picture},
        image::Image,
    };
    let mut assets = checkerboard(16, 12, None);
    let color = Image::filled(8, 8, [1.0; 4]);
    assets.insert_picture(
        "depth.exr",
        Picture { depth: Some(vec![1.0; 64]), ..Picture::opaque(color, Encoding::LinearSrgb) },
    );
    let text = format!("{CAMERA}[plate]\nimage = \"plate.png\"\ndepth = \"depth.exr\"\n");
    let error = compiled("scene.toml", &text, &kinds(), assets.clone()).err().unwrap().to_string();
    assert!(error.contains("plate.depth: depth.exr: has 8 x 8 pixels; allowed: 16 x 12"), "{error}");
    assert!(error.starts_with("scene.toml:"), "{error}");
    let flat = text.replace("depth.exr", "plate.png");
    let error = compiled("scene.toml", &flat, &kinds(), assets).err().unwrap().to_string();
    assert!(error.contains("plate.depth: plate.png: has no channel `Z`"), "{error}");
}
