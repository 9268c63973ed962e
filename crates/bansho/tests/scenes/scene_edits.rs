//! Edits of a scene's text by `--set`.

use bansho::{
    KINDS,
    scene::edit::{self, EditError},
};

fn set(text: &str, assignment: &str) -> Result<String, EditError> {
    edit::set(text, assignment, KINDS)
}

const SCENE: &str =
    "bansho = 2\n[picture]\nsize = [64, 36] # small\n[[flame_sheet]]\nname = \"left log\"\n[[flame_sheet]]\n";

#[test]
fn values_are_replaced_and_comments_survive() {
    let text = set(SCENE, "picture.size=[8, 9]").unwrap();
    assert!(text.contains("size = [8, 9] # small"), "{text}");
}

#[test]
fn one_phenomenon_is_picked_by_name_or_number_and_all_without() {
    let text = set(SCENE, "flame_sheet.left log.height = 2").unwrap();
    assert_eq!(text.matches("height = 2").count(), 1);
    let text = set(SCENE, "flame_sheet.1.height=2").unwrap();
    assert!(text.trim_end().ends_with("height = 2"), "{text}");
    let text = set(SCENE, "flame_sheet.height=2").unwrap();
    assert_eq!(text.matches("height = 2").count(), 2);
}

#[test]
fn absent_tables_are_made_and_bare_words_are_strings() {
    let text = set(SCENE, "wind.gust=0.5").unwrap();
    assert!(text.contains("[wind]") && text.contains("gust = 0.5"), "{text}");
    assert!(set(SCENE, "camera.lens=fisheye").unwrap().contains("lens = \"fisheye\""));
}

#[test]
fn places_that_are_not_there_are_named() {
    assert!(matches!(set(SCENE, "flame_sheet.7.height=2"), Err(EditError::NoSuchPath { .. })));
    assert!(matches!(set(SCENE, "picture.size"), Err(EditError::InvalidAssignment(_))));
    assert!(matches!(set(SCENE, "=3"), Err(EditError::InvalidAssignment(_))));
    assert!(matches!(set(SCENE, "picture..size=3"), Err(EditError::InvalidAssignment(_))));
    // Found by fuzzing: a path so deep that its result could not be read again.
    let deep = format!("picture{}=3", ".a".repeat(100));
    assert!(matches!(set(SCENE, &deep), Err(EditError::InvalidAssignment(_))));
    let nested = format!("picture.a.b.c.d={}{}", "[".repeat(78), "]".repeat(78));
    assert!(matches!(set(SCENE, &nested), Err(EditError::InvalidAssignment(_))));
}

#[test]
fn lists_of_tables_within_tables_are_reached_in_both_ways_of_writing_them() {
    let headed = "bansho = 2\n[[flame_particles]]\n[[flame_particles.burners]]\nspeed = 1 # slow\n\
                  [[flame_particles.burners]]\n";
    let in_a_line = "bansho = 2\n[[flame_particles]]\nburners = [{ speed = 1 }, { }]\n";
    for scene in [headed, in_a_line] {
        let text = set(scene, "flame_particles.0.burners.0.speed=2.5").unwrap();
        assert_eq!((text.matches("speed = 2.5").count(), text.matches("speed").count()), (1, 1), "{text}");
        let text = set(scene, "flame_particles.burners.1.diameter=0.2").unwrap();
        assert!(text.contains("speed = 1") && text.matches("diameter = 0.2").count() == 1, "{text}");
        assert_eq!(set(scene, "flame_particles.burners.speed=3").unwrap().matches("speed = 3").count(), 2);
        let beyond = set(scene, "flame_particles.0.burners.2.speed=1").unwrap_err().to_string();
        assert!(beyond.contains("burners.2.speed`: 2 is not in the scene; available: tables 0 to 1"), "{beyond}");
        let whole = set(scene, "flame_particles.0.burners.0=1");
        assert!(matches!(whole, Err(EditError::InvalidAssignment(_))), "{whole:?}");
    }
    assert!(set(headed, "flame_particles.0.burners.0.speed=2").unwrap().contains("speed = 2 # slow"));
    let none = set("bansho = 2\n[[flame_particles]]\nsmoke = 1\n", "flame_particles.0.burners.0.speed=1");
    let none = none.unwrap_err().to_string();
    assert!(none.contains("burners is not in the scene; available: smoke"), "{none}");
}

#[test]
fn single_values_of_lists_are_reached_by_number() {
    assert!(set(SCENE, "picture.size.1=9").unwrap().contains("size = [64, 9] # small"));
    for path in ["picture.size.2", "picture.size.x", "picture.size.0.x"] {
        let error = set(SCENE, &format!("{path}=1")).unwrap_err().to_string();
        assert!(error.contains("available: values 0 to 1"), "{error}");
    }
}

#[test]
fn a_path_without_its_table_gets_the_tables_that_have_such_a_parameter() {
    let told = |scene: &str, assignment: &str| set(scene, assignment).unwrap_err().to_string();
    let height = told(SCENE, "height=2");
    assert_eq!(
        height,
        "`height` is not in the scene, did you mean `flame_sheet.height`?; available: bansho, picture, flame_sheet"
    );
    let both = "bansho = 2\n[[rain]]\n[[flame_particles]]\nburners = [{}]\n";
    for (scene, assignment, expected) in [
        (SCENE, "gust=1", "did you mean `wind.gust`?"),
        (SCENE, "flame_sheat.height=2", "did you mean `flame_sheet.height`?"),
        (SCENE, "flame_sheat.1.height=2", "did you mean `flame_sheet.1.height`?"),
        (SCENE, "hieght=2", "did you mean `flame_sheet.height`?"),
        (SCENE, "fire.height=2", "did you mean `flame_sheet.height`?"),
        (both, "rate_mm_per_h=2", "did you mean `rain.rate_mm_per_h`?"),
        (both, "burners.diameter=2", "did you mean `flame_particles.burners.diameter`?"),
    ] {
        let told = told(scene, assignment);
        assert!(told.contains(expected), "{assignment}: {told}");
    }
    assert!(!told(SCENE, "rate_mm_per_h=2").contains("rain"), "there is no rain in that scene");
    assert!(!told(SCENE, "zzzzqqq=2").contains("did you mean"));
    assert!(set(SCENE, "bansho=2").is_ok() && set(SCENE, "wind={ gust = 1 }").is_ok());
}
