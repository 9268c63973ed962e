//! Pictures of the shipped scenes: small golden pictures, and for each scene measurements that a crude imitation would not pass.
//!
//! `BANSHO_BLESS=1 cargo test -p bansho --test pictures` rewrites the goldens; the reason goes into CHANGELOG.md under
//! "Changes the picture".
#![cfg(feature = "files")]

mod aurora;
mod burners;
mod flames;
mod gas;
mod looks;
mod rain;
mod templates;

use looks::golden;

/// Size of goldens and of most measurements.
const SMALL: [usize; 2] = [256, 144];

/// Scenes with the frame that is compared: of an aurora an early one, since it has settled before the first.
const GOLDENS: [(&str, [usize; 2], i64); 33] = [
    ("candle", SMALL, 40),
    ("torch", SMALL, 40),
    ("campfire", SMALL, 40),
    ("hearth", SMALL, 40),
    ("ohshima_itahashi", SMALL, 40),
    ("inagaki_still", SMALL, 40),
    ("inagaki_wind_left", SMALL, 40),
    ("inagaki_wind_right", SMALL, 40),
    ("inagaki_paper", SMALL, 40),
    ("inagaki_haze", SMALL, 40),
    ("inagaki_density", SMALL, 40),
    ("torch_in_gusts", SMALL, 40),
    ("burning_mesh", SMALL, 40),
    ("bonfire", SMALL, 4),
    ("street_lamp", SMALL, 40),
    ("street_lamp_near", SMALL, 40),
    ("headlights", SMALL, 40),
    ("headlights_ahead", SMALL, 40),
    ("downpour_day", SMALL, 40),
    ("drizzle", SMALL, 40),
    ("rain_over_plate", SMALL, 40),
    ("campfire_in_rain", SMALL, 40),
    ("quiet_arc", SMALL, 4),
    ("corona", SMALL, 4),
    ("red_aurora", SMALL, 4),
    ("lake", SMALL, 4),
    ("sekiguchi_2", SMALL, 4),
    ("sekiguchi_5", SMALL, 4),
    ("dome_night", [160, 160], 4),
    // What the thesis's scenes are about: a fold, a split, a merge, two folds that have turned.
    ("sekiguchi_1", SMALL, 240),
    ("sekiguchi_2", SMALL, 170),
    ("sekiguchi_3", SMALL, 230),
    ("sekiguchi_4", SMALL, 300),
];

#[test]
fn golden_pictures_are_as_they_were() {
    let changed: Vec<String> =
        GOLDENS.into_iter().filter_map(|(scene, size, frame)| golden(scene, size, frame)).collect();
    assert!(changed.is_empty(), "{}", changed.join("\n"));
}
