//! Builds scenes in code, from structs of parameters.

use std::fmt::Write;

use bansho_base::{
    camera::CameraParameters,
    parameters::{Parameters, Table, Value},
    phenomenon::kind::Describe,
    world::{air::Air, obstacle::ObstacleParameters, sky::SkyParameters, wind::WindParameters},
};
use bansho_scene::{FORMAT, LightParameters, PictureParameters, PlateParameters, Scene, SceneError};

use crate::parse_scene;
use bansho_environment::ground::GroundParameters;

/// Collects the tables of a scene. Values are checked by [`build`](Self::build), like those of a scene file.
///
/// ```
/// use bansho::{SceneBuilder, scene::PictureParameters};
///
/// let picture = PictureParameters { size: [64, 36], frames: 2, ..Default::default() };
/// let scene = SceneBuilder::new().picture(&picture).build()?;
/// assert_eq!(scene.picture.size, [64, 36]);
/// # Ok::<(), bansho::SceneError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    text: String,
}

impl Default for SceneBuilder {
    fn default() -> Self {
        Self { text: format!("bansho = {FORMAT}\n") }
    }
}

impl SceneBuilder {
    /// An empty scene with all defaults.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the picture: size, frames, exposure. Call it once.
    pub fn picture(self, parameters: &PictureParameters) -> Self {
        self.table("[picture]", None, parameters.to_table())
    }

    /// Sets the camera. Call it once.
    pub fn camera(self, parameters: &CameraParameters) -> Self {
        self.table("[camera]", None, parameters.to_table())
    }

    /// Sets the plate over which the phenomena are composited. Call it once.
    pub fn plate(self, parameters: &PlateParameters) -> Self {
        self.table("[plate]", None, parameters.to_table())
    }

    /// Sets the wind, which affects all phenomena. Call it once.
    pub fn wind(self, parameters: &WindParameters) -> Self {
        self.table("[wind]", None, parameters.to_table())
    }

    /// Sets the air: temperature, pressure and others. Call it once.
    pub fn air(self, parameters: &Air) -> Self {
        self.table("[air]", None, parameters.to_table())
    }

    /// Adds a sky. Call it once.
    pub fn sky(self, parameters: &SkyParameters) -> Self {
        self.table("[sky]", None, parameters.to_table())
    }

    /// Adds a ground. Call it once.
    pub fn ground(self, parameters: &GroundParameters) -> Self {
        self.table("[ground]", None, parameters.to_table())
    }

    /// Adds a light.
    pub fn light(self, parameters: &LightParameters) -> Self {
        self.table("[[light]]", None, parameters.to_table())
    }

    /// Adds an obstacle.
    pub fn obstacle(self, parameters: &ObstacleParameters) -> Self {
        self.table("[[obstacle]]", None, parameters.to_table())
    }

    /// Adds a phenomenon, such as a flame sheet. Names are unique in a scene.
    pub fn phenomenon<P: Describe>(self, name: &str, parameters: &P) -> Self {
        self.table(&format!("[[{}]]", P::KEY), Some(name), parameters.to_table())
    }

    /// The text of the scene file.
    pub fn to_toml(&self) -> &str {
        &self.text
    }

    /// Checks all values and returns the scene.
    ///
    /// # Errors
    /// The same errors as for a scene file; lines are those of [`to_toml`](Self::to_toml).
    pub fn build(&self) -> Result<Scene, SceneError> {
        parse_scene("scene", &self.text)
    }

    fn table(mut self, header: &str, name: Option<&str>, table: Table) -> Self {
        let name = name.map(|name| ("name".to_owned(), Value::Text(name.to_owned())));
        let entries = table.entries.into_iter().map(|entry| (entry.key, entry.node.value));
        self.text.push_str(&format!("\n{header}\n"));
        for (key, value) in name.into_iter().chain(entries) {
            // Writing to a string cannot fail.
            let _ = writeln!(self.text, "{key} = {value}");
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use bansho_scene::SHARED_TABLES;

    use super::*;

    #[test]
    fn a_built_scene_has_the_given_parameters() {
        let picture = PictureParameters { size: [320, 200], first_frame: -7, ..Default::default() };
        let camera = CameraParameters { vertical_fov_deg: 55.0.into(), ..Default::default() };
        let air = Air { temperature_k: 260.0, ..Default::default() };
        let ground = GroundParameters::default();
        let obstacle = ObstacleParameters { radius: 0.7, ..Default::default() };
        let builder = SceneBuilder::new()
            .picture(&picture)
            .camera(&camera)
            .plate(&PlateParameters::default())
            .wind(&WindParameters::default())
            .air(&air)
            .sky(&SkyParameters::default())
            .ground(&ground)
            .light(&LightParameters::default())
            .obstacle(&obstacle)
            .obstacle(&ObstacleParameters::default());
        for table in SHARED_TABLES {
            assert!(builder.to_toml().contains(&format!("[{}]", table.key)), "no table [{}]", table.key);
        }
        let scene = builder.build().unwrap();
        assert_eq!((scene.picture, scene.camera, scene.air), (picture, camera, air));
        assert_eq!((scene.wind, scene.plate), (WindParameters::default(), PlateParameters::default()));
        assert_eq!((scene.sky, scene.ground), (Some(SkyParameters::default()), Some(ground)));
        assert_eq!(scene.lights, [LightParameters::default()]);
        assert_eq!(scene.obstacles, [obstacle, ObstacleParameters::default()]);
    }

    #[test]
    fn values_out_of_range_are_refused_as_in_a_file() {
        let picture = PictureParameters { size: [0, 200], ..Default::default() };
        let error = SceneBuilder::new().picture(&picture).build().err().unwrap();
        assert!(error.to_string().contains("picture.size"), "{error}");
    }
}
