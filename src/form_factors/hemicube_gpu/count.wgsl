// Sums the delta form factors of the pixels that see each patch.

struct Camera {
    right: vec4<f32>,
    up: vec4<f32>,
    forward: vec4<f32>,
    eye: vec4<f32>,
}

// Corners of a source triangle, and how its front and its back are cut into patches.
struct Source {
    ax: f32, ay: f32, az: f32, front_first: u32,
    bx: f32, by: f32, bz: f32, back_first: u32,
    cx: f32, cy: f32, cz: f32,
    // Level of the front in the low half, of the back in the high half.
    levels: u32,
}

struct Job {
    // Pixels along a hemicube's top.
    resolution: u32,
    // Items below this are patches, others source triangles.
    first_source: u32,
    // Patches that are counted: the first, and how many.
    first: u32,
    count: u32,
    // Sums a row; the last two are the environment and backs.
    stride: u32,
}

@group(0) @binding(0) var<uniform> job: Job;
@group(0) @binding(1) var items: texture_2d_array<u32>;
@group(0) @binding(2) var<storage, read> cameras: array<Camera>;
@group(0) @binding(3) var<storage, read> weights: array<u32>;
@group(0) @binding(4) var<storage, read> sources: array<Source>;
@group(0) @binding(5) var<storage, read_write> sums: array<atomic<u32>>;

const NOTHING: u32 = 0xffffffffu;
const NO_PATCH: u32 = 0xffffu;
const ENVIRONMENT: u32 = 0xffffffffu;
const BACK: u32 = 0xfffffffeu;
// Neighbouring pixels that one invocation sums before it adds to memory.
const RUN: u32 = 8u;

// A source triangle seen from a hemicube's centre.
struct View {
    first: u32,
    // Strips along each side; 0 for a side without patches.
    strips: u32,
    edges: mat3x3<f32>,
}

fn view(source: Source, eye: vec3<f32>) -> View {
    let a = vec3(source.ax, source.ay, source.az) - eye;
    let b = vec3(source.bx, source.by, source.bz) - eye;
    let c = vec3(source.cx, source.cy, source.cz) - eye;
    // A front has its normal towards the eye.
    let back = dot(cross(b - a, c - a), a) > 0.0;
    let level = select(source.levels & 0xffffu, source.levels >> 16u, back);
    let first = select(source.front_first, source.back_first, back);
    let strips = select(1u << (level & 31u), 0u, level == NO_PATCH);
    return View(first, strips, mat3x3(cross(b, c), cross(c, a), cross(a, b)));
}

// Index of the patch in a grid of `strips` strips in direction `d`; twin of `index_in_grid`.
fn index_in_grid(seen: View, d: vec3<f32>) -> u32 {
    let f = d * seen.edges;
    let n = f32(seen.strips);
    let scale = n / (f.x + f.y + f.z);
    let u = max(f.x * scale, 0.0);
    let v = max(f.y * scale, 0.0);
    let i = min(floor(u), n - 1.0);
    let j = min(floor(v), n - 1.0 - i);
    let inverted = (u - i) + (v - j) > 1.0 && i + j + 2.0 <= n;
    let index = u32(i) * (2u * seen.strips - u32(i)) + 2u * u32(j) + u32(inverted);
    return min(index, seen.strips * seen.strips - 1u);
}

fn add(row: u32, patch_seen: u32, weight: u32) {
    var at = patch_seen - job.first;
    if patch_seen == ENVIRONMENT {
        at = job.stride - 2u;
    } else if patch_seen == BACK {
        at = job.stride - 1u;
    } else if patch_seen < job.first || at >= job.count {
        return;
    }
    atomicAdd(&sums[row * job.stride + at], weight);
}

@compute @workgroup_size(8, 8)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = job.resolution;
    let half = n / 2u;
    let low = id.x * RUN;
    let line = id.y;
    let row = id.z;
    if low >= n || line >= 3u * n {
        return;
    }

    // The top, then the four sides, one below the other.
    var face = 0u;
    var face_line = line;
    var table = 0u;
    var y = f32(2u * line + 1u) / f32(n) - 1.0;
    if line >= n {
        face = 1u + (line - n) / half;
        face_line = (line - n) % half;
        table = n * n;
        y = f32(2u * face_line + 1u) / f32(n);
    }
    let camera = cameras[5u * row + face];
    let towards = camera.forward.xyz + y * camera.up.xyz;

    var item = NOTHING;
    var seen: View;
    var patch_seen = ENVIRONMENT;
    var sum = 0u;
    for (var x = low; x < min(low + RUN, n); x += 1u) {
        let here = textureLoad(items, vec2(x, line), row, 0).x;
        var patch_here = here;
        if here != NOTHING && here >= job.first_source {
            if here != item {
                seen = view(sources[here - job.first_source], camera.eye.xyz);
            }
            if seen.strips == 0u {
                patch_here = BACK;
            } else {
                let d = towards + (f32(2u * x + 1u) / f32(n) - 1.0) * camera.right.xyz;
                patch_here = seen.first + index_in_grid(seen, d);
            }
        }
        item = here;
        if patch_here != patch_seen {
            if sum > 0u {
                add(row, patch_seen, sum);
            }
            patch_seen = patch_here;
            sum = 0u;
        }
        sum += weights[table + face_line * n + x];
    }
    if sum > 0u {
        add(row, patch_seen, sum);
    }
}
