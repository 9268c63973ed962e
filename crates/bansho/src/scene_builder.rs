//! Builds scenes in code, from structs of parameters.

use std::fmt::Write;

use bansho_base::{
    camera::CameraParameters,
    parameters::{Entry, Parameters, Table, Value},
    tables::{PhenomenonTable, SharedTable},
    world::{air::Air, wind::WindParameters},
};
use bansho_environment::{
    ground::GroundParameters, lamps::LightParameters, sky::SkyParameters, solids::ObstacleParameters,
};
use bansho_scene::{FORMAT, ParameterProblems, PictureParameters, PlateParameters, Scene};

use crate::KINDS;

/// Collects the tables of a scene. Values are checked by [`build`](Self::build), like those of a scene file, but no text is printed or parsed.
///
/// Of a phenomenon's parameters only those count as stated that differ from their defaults, so that a flame of default position and size is seen by the
/// default camera of a scene that has only that flame.
///
/// ```
/// use bansho::{PictureParameters, SceneBuilder};
///
/// let picture = PictureParameters { size: [64, 36], frames: 2, ..Default::default() };
/// let scene = SceneBuilder::new().picture(&picture).build()?;
/// assert_eq!(scene.picture.size, [64, 36]);
/// # Ok::<(), bansho::ParameterProblems>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneBuilder {
    root: Table,
}

impl SceneBuilder {
    /// An empty scene with all defaults.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the picture: size, frames, exposure.
    pub fn picture(self, parameters: &PictureParameters) -> Self {
        self.table("picture", parameters.to_table())
    }

    /// Sets the camera.
    pub fn camera(self, parameters: &CameraParameters) -> Self {
        self.table("camera", parameters.to_table())
    }

    /// Sets the plate over which the phenomena are composited.
    pub fn plate(self, parameters: &PlateParameters) -> Self {
        self.table("plate", parameters.to_table())
    }

    /// Sets the wind, which affects all phenomena.
    pub fn wind(self, parameters: &WindParameters) -> Self {
        self.table("wind", parameters.to_table())
    }

    /// Sets the air: temperature, pressure and others.
    pub fn air(self, parameters: &Air) -> Self {
        self.table("air", parameters.to_table())
    }

    /// Sets a table that all phenomena share; of a kind of which a scene may have many, adds one.
    pub fn shared(self, parameters: &impl SharedTable) -> Self {
        let (kind, table) = (parameters.kind(), parameters.canonical());
        if kind.is_list() { self.item(kind.key, table) } else { self.table(kind.key, table) }
    }

    /// Sets the sky.
    pub fn sky(self, parameters: &SkyParameters) -> Self {
        self.shared(parameters)
    }

    /// Sets the ground.
    pub fn ground(self, parameters: &GroundParameters) -> Self {
        self.shared(parameters)
    }

    /// Adds a light.
    pub fn light(self, parameters: &LightParameters) -> Self {
        self.shared(parameters)
    }

    /// Adds an obstacle.
    pub fn obstacle(self, parameters: &ObstacleParameters) -> Self {
        self.shared(parameters)
    }

    /// Adds a phenomenon, such as a flame sheet. Names are unique in a scene.
    pub fn phenomenon<P: PhenomenonTable + Parameters>(self, name: &str, parameters: &P) -> Self {
        let mut stated = Table::default();
        stated.push("name", Value::Text(name.to_owned()));
        let defaults = P::default().to_table();
        for entry in parameters.to_table().entries {
            if defaults.get(&entry.key).is_none_or(|default| default.value != entry.node.value) {
                stated.entries.push(entry);
            }
        }
        self.item(parameters.kind().key, stated)
    }

    /// The scene as the text of a scene file.
    pub fn to_toml(&self) -> String {
        let mut text = format!("bansho = {FORMAT}\n");
        for Entry { key, node, .. } in &self.root.entries {
            match &node.value {
                Value::List(items) => {
                    for item in items {
                        write_table(&mut text, &format!("[[{key}]]"), &item.value);
                    }
                }
                table => write_table(&mut text, &format!("[{key}]"), table),
            }
        }
        text
    }

    /// Checks all values and returns the scene.
    ///
    /// # Errors
    /// Every value that is out of range or not finite, values that contradict each other, equal names: each with the path of the parameter and what is
    /// allowed.
    pub fn build(&self) -> Result<Scene, ParameterProblems> {
        Scene::from_table(&self.root, KINDS)
    }

    /// Replaces or adds a table.
    fn table(mut self, key: &str, table: Table) -> Self {
        self.root.entries.retain(|entry| entry.key != key);
        self.root.push(key, Value::Table(table));
        self
    }

    /// Adds a table to a list of tables.
    fn item(mut self, key: &str, table: Table) -> Self {
        match self.root.entries.iter_mut().find(|entry| entry.key == key).map(|entry| &mut entry.node.value) {
            Some(Value::List(items)) => items.push(Value::Table(table).into()),
            _ => self.root.push(key, Value::List(vec![Value::Table(table).into()])),
        }
        self
    }
}

fn write_table(text: &mut String, header: &str, table: &Value) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "\n{header}");
    if let Value::Table(Table { entries }) = table {
        for Entry { key, node, .. } in entries {
            let _ = writeln!(text, "{key} = {}", node.value);
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::tables;
    use bansho_environment::fog::FogParameters;

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
            .obstacle(&ObstacleParameters::default())
            .shared(&FogParameters::default());
        for kind in tables::shared(KINDS) {
            assert!(builder.to_toml().contains(&kind.header()), "no table {}", kind.header());
        }
        let scene = builder.build().unwrap();
        let printed = crate::parse_scene("scene", &builder.to_toml()).unwrap();
        let lights = |scene: &Scene| scene.tables.all().cloned().collect::<Vec<LightParameters>>();
        assert_eq!((&printed.picture, lights(&printed)), (&scene.picture, lights(&scene)));
        let tables = &scene.tables;
        assert_eq!((&scene.picture, &scene.camera, &scene.air), (&picture, &camera, &air));
        assert_eq!((&scene.wind, &scene.plate), (&WindParameters::default(), &PlateParameters::default()));
        assert_eq!((tables.get(), tables.get()), (Some(&SkyParameters::default()), Some(&ground)));
        assert_eq!(lights(&scene), [LightParameters::default()]);
        let obstacles: Vec<&ObstacleParameters> = tables.all().collect();
        assert_eq!(obstacles, [&obstacle, &ObstacleParameters::default()]);
    }

    #[test]
    fn values_out_of_range_are_refused_as_in_a_file() {
        let picture = PictureParameters { size: [0, 200], ..Default::default() };
        let error = SceneBuilder::new().picture(&picture).build().err().unwrap();
        assert!(error.to_string().contains("picture.size"), "{error}");
        let wind = WindParameters { gust: f64::NAN, ..Default::default() };
        let error = SceneBuilder::new().wind(&wind).build().err().unwrap();
        assert_eq!(error.to_string(), "wind.gust: NaN is out of range; allowed: 0 to 2");
    }
}
