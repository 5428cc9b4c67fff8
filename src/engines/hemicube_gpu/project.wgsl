// Projects triangles on one face of a hemicube: the item of each, and its nearness as depth.

struct Camera {
    right: vec4<f32>,
    // .w: what the clip-space y takes of `up` and `forward`: (1, 0) for the top, whose pixels cover
    // y from -1 to 1, and (2, -1) for the sides, which cover y from 0 to 1.
    up: vec4<f32>,
    forward: vec4<f32>,
    // .w: distance of the near plane.
    eye: vec4<f32>,
}

@group(0) @binding(0) var<storage, read> cameras: array<Camera>;

/// Depth is scaled by this: a little less than 1 moves what is drawn away.
override nearness: f32 = 1.0;

struct Projected {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, first) item: u32,
}

// The item counts at a triangle's first vertex only.
@vertex
fn project(
    @location(0) position: vec3<f32>,
    @location(1) item: u32,
    @builtin(instance_index) face: u32,
) -> Projected {
    let camera = cameras[face];
    let d = position - camera.eye.xyz;
    let x = dot(d, camera.right.xyz);
    let y = dot(d, camera.up.xyz);
    let z = dot(d, camera.forward.xyz);
    // The first line of pixels has the lowest y. The far plane is at infinity: depth = near / z.
    let up = camera.up.w * y + camera.forward.w * z;
    return Projected(vec4(x, -up, nearness * camera.eye.w, z), item);
}

@fragment
fn keep(seen: Projected) -> @location(0) u32 {
    return seen.item;
}
