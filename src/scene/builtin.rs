//! Built-in scenes, made by the program itself: one-sided closed solids in rooms that face inwards.

mod cornell_box;
mod furnace;
mod furniture;
pub mod mesh;
mod paper;
mod room;
mod solids;
mod stage;

use super::Scene;

pub use furnace::{FURNACE_REFLECTANCE, closed_room};
pub use mesh::Mesh;

/// A scene that the program makes itself.
#[derive(Debug, Clone, Copy)]
pub struct Builtin {
    /// What [`build`] knows it by.
    pub name: &'static str,
    /// One line for a list of scenes.
    pub summary: &'static str,
    make: fn() -> Scene,
}

const BUILTINS: &[Builtin] = &[
    Builtin {
        name: "cornell-box",
        summary: "the Cornell box as measured: two blocks, a red and a green wall, open in front",
        make: cornell_box::cornell_box,
    },
    Builtin {
        name: "furnace",
        summary: "a closed glowing cube whose radiosity is known exactly: B = E / (1 - rho)",
        make: furnace::furnace,
    },
    Builtin {
        name: "room",
        summary: "a furnished room with a sculpture, a ceiling panel and a floor lamp",
        make: room::room,
    },
    Builtin {
        name: "paper-1",
        summary: "a hall with seven simple objects and two lights",
        make: paper::paper_1,
    },
    Builtin {
        name: "paper-2",
        summary: "a hall with eight simple objects, a torus knot and three lights",
        make: paper::paper_2,
    },
    Builtin {
        name: "paper-3",
        summary: "a tall hall with eight simple objects, a torus knot and four lights, two of them finely shaped",
        make: paper::paper_3,
    },
];

/// All built-in scenes.
#[must_use]
pub fn list() -> &'static [Builtin] {
    BUILTINS
}

/// Makes the built-in scene of that name; `None` if there is none.
#[must_use]
pub fn build(name: &str) -> Option<Scene> {
    BUILTINS.iter().find(|b| b.name == name).map(|b| (b.make)())
}

/// There is no built-in scene of that name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: no such built-in scene; the built-in scenes are {known}")]
pub struct UnknownBuiltin {
    /// What was asked for.
    pub name: String,
    /// The names of all that there are.
    pub known: String,
}

impl Scene {
    /// Makes the built-in scene of that name ([`builtin::list`](list) has them all).
    ///
    /// ```
    /// use hemicube::scene::Scene;
    ///
    /// assert!(Scene::builtin("cornell-box")?.optics.emits());
    /// # Ok::<(), hemicube::scene::builtin::UnknownBuiltin>(())
    /// ```
    ///
    /// # Errors
    /// If there is none.
    pub fn builtin(name: &str) -> Result<Self, UnknownBuiltin> {
        build(name).ok_or_else(|| UnknownBuiltin {
            name: name.to_owned(),
            known: BUILTINS.iter().map(|b| b.name).collect::<Vec<_>>().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Sides, TriangleId, TriangleState};

    /// Height over longest edge below which a triangle counts as a sliver.
    const SLIVER: f64 = 0.02;

    #[test]
    fn scenes_are_found_by_their_name() {
        for builtin in list() {
            let scene = build(builtin.name).expect("a listed scene can be built");
            assert_eq!(scene.name, builtin.name);
            assert_eq!(scene.cameras[0].name, "main");
            assert!(scene.optics.emits());
            assert!(scene.findings.is_empty());
        }
        let error = Scene::builtin("nowhere").unwrap_err().to_string();
        assert!(error.starts_with("nowhere: no such") && error.contains("cornell-box, furnace"));
    }

    #[test]
    fn triangles_are_sound_and_one_sided() {
        for builtin in list() {
            let g = (builtin.make)().geometry;
            assert!(g.state.iter().all(|&p| p == TriangleState::Solid), "{}", builtin.name);
            assert!(g.sides.iter().all(|&s| s == Sides::One), "{}", builtin.name);
            let shape = |t: TriangleId| {
                let [a, b, c] = g.corners(t);
                let longest = (b - a).length().max((c - b).length()).max((a - c).length());
                2.0 * g.area(t) / longest.powi(2)
            };
            for t in g.ids() {
                let surface = &g.surfaces[g.surface_of[t.index()] as usize].name;
                assert!(shape(t) > SLIVER, "{}: {surface}: {:.4}", builtin.name, shape(t));
            }
        }
    }

    #[test]
    fn cameras_look_at_a_front() {
        for builtin in list() {
            let scene = (builtin.make)();
            for camera in &scene.cameras {
                assert!(camera.forward.is_normalized());
                let towards = first_front(&scene, camera.eye, camera.forward);
                assert_eq!(towards, Some(true), "{}: {}", builtin.name, camera.name);
            }
        }
    }

    /// Whether the first triangle along a ray shows its front; `None` if the ray meets nothing.
    fn first_front(scene: &Scene, from: glam::DVec3, along: glam::DVec3) -> Option<bool> {
        let g = &scene.geometry;
        g.ids()
            .filter_map(|t| {
                let [a, b, c] = g.corners(t);
                let n = (b - a).cross(c - a);
                let distance = (a - from).dot(n) / along.dot(n);
                let p = from + along * distance;
                let inside = [(a, b), (b, c), (c, a)]
                    .iter()
                    .all(|&(u, v)| (v - u).cross(p - u).dot(n) >= 0.0);
                (distance > 1e-6 && inside).then_some((distance, along.dot(n) < 0.0))
            })
            .min_by(|x, y| x.0.total_cmp(&y.0))
            .map(|(_, front)| front)
    }
}
