//! The node graph: meshes, cameras and lamps, placed.

use std::f64::consts::PI;

use glam::{DMat4, DQuat, DVec3};
use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use gltf::json::validation::Checked;

use super::document::{Document, label};
use super::material::Materials;
use super::mesh::{self, Instance, Placed};
use crate::scene::builder::SceneBuilder;
use crate::scene::optics::MOST_RADIANCE;
use crate::scene::source::{EXPORT_AGAIN, ImportError};
use crate::scene::{Camera, Finding, Lamp, Rgb, Setting, Severity};

/// Adds the default scene of the document (all root nodes if it has no scene).
pub fn add_scene(document: &Document<'_>, builder: &mut SceneBuilder) -> Result<(), ImportError> {
    let nodes = &document.root.nodes;
    let mut open: Vec<(usize, DMat4)> =
        roots(document, builder)?.into_iter().rev().map(|n| (n, DMat4::IDENTITY)).collect();
    let mut reached = vec![false; nodes.len()];
    let mut materials = Materials::default();
    let mut placed = Placed::default();
    while let Some((index, world_from_parent)) = open.pop() {
        let Some(node) = nodes.get(index) else {
            let problem = "does not exist, but a scene or node refers to it";
            return Err(document.malformed(format!("node {index}"), problem, EXPORT_AGAIN));
        };
        let place = || label("node", index, node.name.as_deref());
        if std::mem::replace(&mut reached[index], true) {
            let problem = "has two parents or is its own ancestor";
            return Err(document.malformed(place(), problem, EXPORT_AGAIN));
        }
        let world_from_node = world_from_parent * local(node);
        if !world_from_node.is_finite() {
            let problem = "its transform is not finite";
            return Err(document.malformed(place(), problem, EXPORT_AGAIN));
        }
        if let Some(mesh) = node.mesh.map(|m| m.value()) {
            let mesh_name = document.root.meshes.get(mesh).and_then(|m| m.name.clone());
            let name = node.name.clone().or(mesh_name).unwrap_or_else(|| format!("node {index}"));
            let object = placed.object(index, &name);
            let instance = Instance {
                node: index,
                name: &name,
                object: &object,
                mesh,
                world_from_mesh: world_from_node,
            };
            mesh::add(document, &instance, &mut materials, &mut placed, builder)?;
            if node.skin.is_some() {
                builder.finding(Severity::Note, place(), "its skin is ignored: rest pose", "");
            }
        }
        if let Some(camera) = node.camera.map(|c| c.value()) {
            add_camera(document, index, camera, world_from_node, builder)?;
        }
        if let Some(light) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
            add_lamp(document, index, light.light.value(), world_from_node, builder)?;
        }
        let children = node.children.iter().flatten().rev();
        open.extend(children.map(|child| (child.value(), world_from_node)));
    }
    if placed.curves > 0 {
        builder.finding(
            Severity::Note,
            "meshes",
            format!("{} primitives of points or lines are left out", placed.curves),
            "convert them to meshes if they should take part",
        );
    }
    Ok(())
}

fn roots(document: &Document<'_>, builder: &mut SceneBuilder) -> Result<Vec<usize>, ImportError> {
    let root = &document.root;
    if root.scenes.len() > 1 {
        builder.finding(
            Severity::Note,
            "scenes",
            format!("the file has {}; only the default one is read", root.scenes.len()),
            "export the others on their own",
        );
    }
    let index = root.scene.map(|s| s.value());
    match (index, root.scenes.get(index.unwrap_or(0))) {
        (_, Some(scene)) => Ok(scene.nodes.iter().map(|n| n.value()).collect()),
        (Some(i), None) => {
            Err(document.malformed(format!("scene {i}"), "does not exist", EXPORT_AGAIN))
        }
        (None, None) => {
            let mut is_child = vec![false; root.nodes.len()];
            for child in root.nodes.iter().filter_map(|n| n.children.as_ref()).flatten() {
                if let Some(flag) = is_child.get_mut(child.value()) {
                    *flag = true;
                }
            }
            Ok((0..root.nodes.len()).filter(|&n| !is_child[n]).collect())
        }
    }
}

fn local(node: &json::Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| v.map(f64::from).into());
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |r| {
        let q = DQuat::from_array(r.0.map(f64::from));
        if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
    });
    DMat4::from_scale_rotation_translation(
        vector(node.scale, DVec3::ONE),
        rotation,
        vector(node.translation, DVec3::ZERO),
    )
}

/// A node's own name first, as that is what modellers show.
fn name(document: &Document<'_>, node: usize, own: Option<&String>, kind: &str) -> String {
    let node_name = document.root.nodes.get(node).and_then(|n| n.name.as_ref());
    node_name.or(own).cloned().unwrap_or_else(|| format!("{kind} {node}"))
}

fn add_camera(
    document: &Document<'_>,
    node: usize,
    index: usize,
    world_from_node: DMat4,
    builder: &mut SceneBuilder,
) -> Result<(), ImportError> {
    let Some(camera) = document.root.cameras.get(index) else {
        let problem = format!("its camera {index} does not exist");
        return Err(document.malformed(format!("node {node}"), problem, EXPORT_AGAIN));
    };
    let name = name(document, node, camera.name.as_ref(), "camera");
    let Some(lens) = &camera.perspective else {
        builder.finding(
            Severity::Note,
            format!("camera {name}"),
            "is orthographic and is left out",
            "make it a perspective camera",
        );
        return Ok(());
    };
    let vfov = f64::from(lens.yfov);
    let forward = world_from_node.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
    let up = world_from_node.transform_vector3(DVec3::Y).normalize_or_zero();
    if !(vfov > 0.0 && vfov < PI) || forward == DVec3::ZERO || up == DVec3::ZERO {
        let left_out = Finding::new(
            Severity::Warning,
            format!("camera {name}"),
            "has no sensible angle of view or orientation and is left out",
            "correct the camera",
        );
        builder.add_finding(left_out.settled_by(Setting::Camera));
        return Ok(());
    }
    builder.camera(Camera {
        name,
        eye: world_from_node.w_axis.truncate(),
        forward,
        up,
        vfov,
        aspect: lens.aspect_ratio.map(f64::from).filter(|a| a.is_finite() && *a > 0.0),
    });
    Ok(())
}

fn add_lamp(
    document: &Document<'_>,
    node: usize,
    index: usize,
    world_from_node: DMat4,
    builder: &mut SceneBuilder,
) -> Result<(), ImportError> {
    let lights = document.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let Some(light) = lights.and_then(|l| l.lights.get(index)) else {
        let problem = format!("its light {index} does not exist");
        return Err(document.malformed(format!("node {node}"), problem, EXPORT_AGAIN));
    };
    let name = name(document, node, light.name.as_ref(), "light");
    let strength = Rgb::from(light.color.map(f64::from)) * f64::from(light.intensity);
    let position = world_from_node.w_axis.truncate();
    let direction = world_from_node.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
    let x_axis = world_from_node.transform_vector3(DVec3::X).normalize_or_zero();
    let spot = light.spot.clone().unwrap_or_default();
    let (inner, outer) = (f64::from(spot.inner_cone_angle), f64::from(spot.outer_cone_angle));
    let aimed = direction != DVec3::ZERO;
    let lamp = match light.type_ {
        Checked::Valid(LightType::Point) => {
            Lamp::Point { name, position, intensity: strength, x_axis, photometry: None }
        }
        Checked::Valid(LightType::Spot) if aimed && outer > 0.0 && outer <= PI / 2.0 => {
            let inner = inner.clamp(0.0, outer);
            let intensity = strength;
            let photometry = None;
            Lamp::Spot { name, position, direction, intensity, inner, outer, x_axis, photometry }
        }
        Checked::Valid(LightType::Directional) if aimed => {
            Lamp::Directional { name, direction, irradiance: strength }
        }
        _ => {
            builder.finding(
                Severity::Warning,
                format!("light {name}"),
                "is of an unknown type or has no sensible cone or direction; it is left out",
                "correct the light and export the model again",
            );
            return Ok(());
        }
    };
    let valid = strength.min_element() >= 0.0 && strength.max_element() <= MOST_RADIANCE;
    if !valid || strength.is_nan() {
        return Err(document.malformed(
            label("light", index, light.name.as_deref()),
            format!("its colour or intensity is negative or exceeds {MOST_RADIANCE:e}"),
            "correct the light and export the model again",
        ));
    }
    builder.lamp(lamp);
    Ok(())
}
