//! What is decided about a model by its shape alone, and from where it is looked at.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use common::shapes::{Shapes, outdoors_share};
use glam::DVec3;
use hemicube::Scene;
use hemicube::scene::{Camera, Sides};
use hemicube::staging::{Kind, Lens, Model, Stage, Viewpoint, viewpoint};

fn kind(scene: &Scene) -> Kind {
    Model::of(scene).unwrap().kind()
}

fn view(scene: &Scene) -> Viewpoint {
    let model = Model::of(scene).unwrap();
    viewpoint(&model, model.kind(), &Lens::default())
}

/// The larger of the shares of the picture's height and width that the model spans.
fn fill(scene: &Scene, camera: &Camera) -> f64 {
    let right = camera.forward.cross(camera.up).normalize();
    let above = right.cross(camera.forward);
    let edge = (0.5 * camera.vfov).tan();
    let spans = [(right, edge * 4.0 / 3.0), (above, edge)].map(|(axis, edge)| {
        let at = scene.geometry.vertices.iter().map(|&v| {
            let way = v - camera.eye;
            way.dot(axis) / way.dot(camera.forward) / edge
        });
        let (low, high) = at.fold((1.0, -1.0), |(a, b): (f64, f64), x| (a.min(x), b.max(x)));
        assert!(low >= -1.0 && high <= 1.0, "it is cut off: {low} to {high}");
        0.5 * (high - low)
    });
    spans[0].max(spans[1])
}

#[track_caller]
fn assert_object(scene: &Scene) {
    assert_eq!(kind(scene), Kind::Object, "{}", scene.name);
    let view = view(scene);
    assert!(!view.inside, "{}: the camera is within the bounds", scene.name);
    let fill = fill(scene, &view.camera);
    assert!((0.7..0.85).contains(&fill), "{}: fills {fill}", scene.name);
    assert!(view.camera.eye.y > scene.geometry.bounds().unwrap().0.y, "{}", scene.name);
}

#[track_caller]
fn assert_room(scene: &Scene) {
    assert_eq!(kind(scene), Kind::Room, "{}", scene.name);
    assert!(view(scene).inside, "{}: the camera is outside", scene.name);
}

/// The same with a face of two triangles turned inwards.
fn turned_face(mut scene: Scene) -> Scene {
    scene.geometry.triangles[..2].iter_mut().for_each(|t| t.swap(1, 2));
    scene
}

#[test]
fn bodies_are_objects() {
    let two = Shapes::new("two").cuboid(DVec3::ZERO, DVec3::ONE).cuboid(DVec3::X * 2.0, DVec3::ONE);
    let sphere = |name: &str, r: f64| Shapes::new(name).sphere(DVec3::ZERO, r).scene();
    for scene in [
        Shapes::new("cube").cuboid(DVec3::ZERO, DVec3::ONE).scene(),
        sphere("sphere", 1.0),
        sphere("tiny", 1e-3),
        sphere("huge", 1e4),
        two.scene(),
        Shapes::new("crossing")
            .cuboid(DVec3::ZERO, DVec3::new(4.0, 1.0, 1.0))
            .cuboid(DVec3::ZERO, DVec3::new(1.0, 4.0, 1.1))
            .cuboid(DVec3::ZERO, DVec3::new(1.2, 1.2, 4.0))
            .scene(),
        turned_face(Shapes::new("a face turned").cuboid(DVec3::ZERO, DVec3::ONE).scene()),
        Shapes::new("cup").cup(1.0, 0.1).scene(),
        Shapes::new("plate").quad(DVec3::ZERO, DVec3::X, DVec3::Y).scene(),
        Shapes::new("ground").quad(DVec3::ZERO, DVec3::Z, DVec3::X).scene(),
    ] {
        assert_object(&scene);
    }
}

#[test]
fn what_faces_inwards_or_holds_furniture_is_a_room() {
    let size = DVec3::new(5.0, 2.8, 4.0);
    let furniture = |s: Shapes| {
        s.cuboid(DVec3::new(-1.0, -1.0, 0.5), DVec3::new(1.2, 0.8, 0.8))
            .cuboid(DVec3::new(1.5, -0.9, -1.0), DVec3::new(0.6, 1.0, 1.6))
    };
    let inwards = Shapes::new("inwards").cuboid(DVec3::ZERO, -size);
    assert_room(&inwards.scene());
    assert_room(&furniture(Shapes::new("outwards").cuboid(DVec3::ZERO, size)).scene());
    assert_room(&furniture(Shapes::new("furnished").cuboid(DVec3::ZERO, -size)).scene());
    assert_room(&Shapes::new("hollow sphere").sphere(DVec3::ZERO, -1.0).scene());
    assert_room(&Shapes::new("window").room_with_window(size).scene());
    assert_room(&Shapes::new("corridor").cuboid(DVec3::ZERO, -DVec3::new(40.0, 2.5, 2.0)).scene());
    let house = Shapes::new("house")
        .cuboid(DVec3::ZERO, DVec3::new(10.4, 3.4, 6.4))
        .cuboid(DVec3::new(-2.6, 0.0, 0.0), -DVec3::new(4.8, 3.0, 6.0))
        .cuboid(DVec3::new(2.6, 0.0, 0.0), -DVec3::new(4.8, 3.0, 6.0));
    assert_room(&house.scene());
}

#[test]
fn a_room_with_an_open_side_is_seen_through_it() {
    for front in [DVec3::Z, DVec3::X, DVec3::NEG_X] {
        let scene = Shapes::new("stage").open_room(front).scene();
        assert_eq!(kind(&scene), Kind::Room);
        let view = view(&scene);
        assert!(!view.inside && view.camera.forward.dot(front) < -0.99, "{front}: {view:?}");
        assert!(view.camera.aspect.is_some_and(|a| (a - 1.0).abs() < 1e-9));
    }
}

#[test]
fn a_one_sided_plate_is_looked_at_from_its_front() {
    for [x, y] in [[DVec3::X, DVec3::Y], [DVec3::Y, DVec3::X], [DVec3::Y, DVec3::Z]] {
        let mut scene = Shapes::new("plate").quad(DVec3::ZERO, x, y).scene();
        scene.geometry.sides.fill(Sides::One);
        let forward = view(&scene).camera.forward;
        assert!(forward.dot(x.cross(y)) < -0.5, "{x} {y}: {forward}");
    }
}

#[test]
fn a_view_of_a_room_is_the_long_one() {
    let scene = Shapes::new("corridor").cuboid(DVec3::ZERO, -DVec3::new(40.0, 2.5, 2.0)).scene();
    let view = view(&scene);
    assert!(view.camera.forward.x.abs() > 0.99, "{view:?}");
    assert!(view.camera.eye.x.abs() > 10.0, "{view:?}");
    assert!((view.camera.eye.y - 0.35).abs() < 1e-3, "1.6 m above the floor: {view:?}");
}

#[test]
fn a_body_can_be_seen_from_within() {
    let scene = Shapes::new("cube").cuboid(DVec3::ZERO, DVec3::ONE).scene();
    let model = Model::of(&scene).unwrap();
    assert!(viewpoint(&model, Kind::Room, &Lens::default()).inside);
    assert!(Model::of(&Scene::default()).is_none());
}

#[test]
fn a_studio_hides_nothing_and_is_no_part_of_the_model() {
    for radius in [1e-3, 1.0, 1e4] {
        let mut scene = Shapes::new("sphere").sphere(DVec3::ZERO, radius).scene();
        let (triangles, bounds) = (scene.geometry.len(), scene.geometry.bounds().unwrap());
        let model = Model::of(&scene).unwrap();
        let camera = viewpoint(&model, model.kind(), &Lens::default()).camera;
        let stage = Stage::of(&model, model.kind(), &camera, false);
        assert!(matches!(stage, Stage::Studio(_)));
        assert_eq!(stage.exposure(), Some(0.0));
        stage.set(&mut scene);
        assert_eq!(scene.geometry.whole_from.map(|t| t.index()), Some(triangles));
        assert!(scene.sky.min_element() > 0.0 && scene.optics.emits());
        // All of the frame is the model or the ground, and the model is where it was.
        assert!(outdoors_share(&scene, &camera, triangles) < 1e-9);
        let low = scene.geometry.vertices[triangles..].iter().map(|v| v.y);
        let ground = low.fold(f64::INFINITY, f64::min);
        let gap = bounds.0.y - ground;
        assert!(gap > 0.0 && gap < 0.01 * radius, "{gap}");
    }
}

#[test]
fn a_room_is_lit_under_its_ceiling_or_through_its_window() {
    let size = DVec3::new(5.0, 2.8, 4.0);
    let stage = |scene: &Scene| {
        let model = Model::of(scene).unwrap();
        let camera = viewpoint(&model, model.kind(), &Lens::default()).camera;
        (model.is_lit(), Stage::of(&model, model.kind(), &camera, false))
    };
    let mut closed = Shapes::new("closed").cuboid(DVec3::ZERO, -size).scene();
    let (lit, ceiling) = stage(&closed);
    assert!(!lit && matches!(&ceiling, Stage::Ceiling(panels) if panels.len() == 1));
    ceiling.set(&mut closed);
    let high = closed.geometry.vertices[8..].iter().all(|v| v.y > 1.2 && v.y < 1.4);
    assert!(high, "{:?}", &closed.geometry.vertices[8..]);
    assert!(stage(&closed).0, "now it is lit");
    let mut open = Shapes::new("window").room_with_window(size).scene();
    let (_, daylight) = stage(&open);
    assert!(matches!(&daylight, Stage::Daylight { sun: Some(_) }), "{daylight:?}");
    daylight.set(&mut open);
    assert!(open.sky.min_element() > 0.0 && open.lamps.len() == 1);
}
