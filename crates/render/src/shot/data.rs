//! What a frame contains as data: particles and lights.

use bansho_base::{geometry::point_cloud::PointCloud, host::observer::Unobserved, phenomenon::surroundings::Light};

use super::Shot;

/// A light with which a phenomenon lights the others.
#[derive(Clone, Debug, PartialEq)]
pub struct PhenomenonLight {
    /// Name of the phenomenon in the scene.
    pub phenomenon: String,
    /// The light: geometry in m, world coordinates with y up; intensity in ACEScg, candela for points.
    pub light: Light,
}

impl Shot {
    /// The particles of all phenomena, at the middle of the exposure of the frame that the shot was advanced to: the gas of particle flames, the electrons of
    /// simulated auroras, and the drops of rain that the camera sees as streaks. The phenomena follow each other in the order of the scene.
    ///
    /// Positions are in m and velocities in m/s, world coordinates with y up. The other [quantities](PointCloud::quantities) state their name and unit
    /// themselves ([`Quantity`](bansho_base::geometry::point_cloud::Quantity)); they are 0 for particles that lack one.
    pub fn particles(&self) -> PointCloud {
        let mut all = PointCloud::default();
        self.point_clouds().into_iter().for_each(|(_, cloud)| all.extend(&cloud));
        all
    }

    /// The [particles](Self::particles) of each phenomenon that can have any, with its name in the scene. They may be none at this frame.
    pub fn point_clouds(&self) -> Vec<(String, PointCloud)> {
        let view = self.context.plan.view_at(self.time);
        let publications = self.publications(view.shutter, &Unobserved);
        let surroundings = self.surroundings(&view, &publications, None);
        let each = self.runs.iter().zip(&surroundings);
        each.filter_map(|(run, surroundings)| {
            Some((run.info().name.to_owned(), run.run.export_particles(&view, surroundings)?))
        })
        .collect()
    }

    /// The lights with which phenomena light each other, at the frame that the shot was advanced to: of each flame the points that approximate its emission,
    /// of an aurora a directional light. Lamps and the sky of the scene are not among them. The phenomena follow each other in the order of the scene.
    pub fn lights(&self) -> Vec<PhenomenonLight> {
        let publications = self.publications(self.context.plan.shutter_at(self.time), &Unobserved);
        let mut lights = Vec::new();
        for (run, publication) in self.runs.iter().zip(publications) {
            let name = run.info().name;
            let of_run = publication.lights.into_iter();
            lights.extend(of_run.map(|light| PhenomenonLight { phenomenon: name.to_owned(), light }));
        }
        lights
    }
}
