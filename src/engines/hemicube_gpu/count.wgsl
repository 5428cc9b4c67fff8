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
    // Whether a cell may belong to another patch than the one of its number: look at `owners`.
    owned: u32,
    // Whether some patches are not the only ones that own their pixels: look at `look_on`.
    looked: u32,
}

@group(0) @binding(0) var<uniform> job: Job;
@group(0) @binding(1) var items: texture_2d_array<u32>;
@group(0) @binding(2) var<storage, read> cameras: array<Camera>;
@group(0) @binding(3) var<storage, read> weights: array<u32>;
@group(0) @binding(4) var<storage, read> sources: array<Source>;
@group(0) @binding(5) var<storage, read_write> sums: array<atomic<u32>>;

// For each cell of the uniform grids its patch, or CUT and where in `cuts` one learns it.
@group(0) @binding(6) var<storage, read> owners: array<u32>;
@group(0) @binding(7) var<storage, read> cuts: array<u32>;
// For each patch the source triangle to look on, or ITSELF.
@group(0) @binding(8) var<storage, read> look_on: array<u32>;

const NOTHING: u32 = 0xffffffffu;
const NO_PATCH: u32 = 0xffffu;
const ENVIRONMENT: u32 = 0xffffffffu;
const BACK: u32 = 0xfffffffeu;
const CUT: u32 = 0x80000000u;
const ITSELF: u32 = 0xffffffffu;
// A cut cell: the owner of each part of a grid of so many strips, or MIXED; then the patch itself,
// the number of others, the number of lines, the patch's centre; for each of the others its number
// and centre; for each line both ends. Points are in coordinates of the cell.
const CUT_STRIPS: u32 = 8u;
const CUT_HEAD: u32 = CUT_STRIPS * CUT_STRIPS;
const CUT_OTHERS: u32 = CUT_HEAD + 5u;
const MIXED: u32 = 0xffffffffu;
// How far a way may pass beside the end of a line and still be barred, in cells: single precision.
const SLACK: f32 = 1e-5;
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

// A cell of a grid, and where in it a point lies.
struct Cell {
    index: u32,
    local: vec2<f32>,
}

// The cell under a point in a grid of `strips` strips; `p` is `strips` times its first two
// barycentric coordinates. Twin of `index_in_grid`.
fn cell_at(strips: u32, p: vec2<f32>) -> Cell {
    let n = f32(strips);
    let u = max(p.x, 0.0);
    let v = max(p.y, 0.0);
    let i = min(floor(u), n - 1.0);
    let j = min(floor(v), n - 1.0 - i);
    let inside = vec2(u - i, v - j);
    let inverted = inside.x + inside.y > 1.0 && i + j + 2.0 <= n;
    let index = u32(i) * (2u * strips - u32(i)) + 2u * u32(j) + u32(inverted);
    return Cell(min(index, strips * strips - 1u), select(inside, 1.0 - inside, inverted));
}

fn cut_point(at: u32) -> vec2<f32> {
    return vec2(bitcast<f32>(cuts[at]), bitcast<f32>(cuts[at + 1u]));
}

fn turn(p: vec2<f32>, q: vec2<f32>, r: vec2<f32>) -> f32 {
    let a = q - p;
    let b = r - p;
    return a.x * b.y - a.y * b.x;
}

// Whether none of the lines of a cut cell parts two points; twin of `Line::parts`.
fn sees(lines: u32, count: u32, a: vec2<f32>, b: vec2<f32>) -> bool {
    for (var k = 0u; k < count; k += 1u) {
        let p = cut_point(lines + 4u * k);
        let q = cut_point(lines + 4u * k + 2u);
        if turn(p, q, a) * turn(p, q, b) < 0.0 {
            let s = turn(a, b, p);
            let t = turn(a, b, q);
            let slack = SLACK * length(b - a);
            if min(s, t) <= slack && max(s, t) >= -slack {
                return false;
            }
        }
    }
    return true;
}

// The patch that a point of a cut cell belongs to; twin of `CutPatch::owner`.
fn owner_at(cut: u32, point: vec2<f32>) -> u32 {
    let part = cuts[cut + cell_at(CUT_STRIPS, point * f32(CUT_STRIPS)).index];
    if part != MIXED {
        return part;
    }
    let others = cuts[cut + CUT_HEAD + 1u];
    let count = cuts[cut + CUT_HEAD + 2u];
    let lines = cut + CUT_OTHERS + 3u * others;
    if !sees(lines, count, point, cut_point(cut + CUT_HEAD + 3u)) {
        for (var k = 0u; k < others; k += 1u) {
            let other = cut + CUT_OTHERS + 3u * k;
            if sees(lines, count, point, cut_point(other + 1u)) {
                return cuts[other];
            }
        }
    }
    return cuts[cut + CUT_HEAD];
}

// The patch that what is seen in direction `d` belongs to.
fn patch_at(seen: View, d: vec3<f32>) -> u32 {
    let f = d * seen.edges;
    let scale = f32(seen.strips) / (f.x + f.y + f.z);
    let cell = cell_at(seen.strips, f.xy * scale);
    let id = seen.first + cell.index;
    if job.owned == 0u {
        return id;
    }
    let owner = owners[id];
    if (owner & CUT) == 0u {
        return owner;
    }
    return owner_at(owner ^ CUT, cell.local);
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

    // The source triangle that `seen` is of.
    var viewed = ITSELF;
    var seen: View;
    var patch_seen = ENVIRONMENT;
    var sum = 0u;
    for (var x = low; x < min(low + RUN, n); x += 1u) {
        let here = textureLoad(items, vec2(x, line), row, 0).x;
        var patch_here = here;
        var source = ITSELF;
        if here != NOTHING {
            if here >= job.first_source {
                source = here - job.first_source;
            } else if job.looked != 0u {
                source = look_on[here];
            }
        }
        if source != ITSELF {
            if source != viewed {
                seen = view(sources[source], camera.eye.xyz);
                viewed = source;
            }
            if seen.strips == 0u {
                patch_here = BACK;
            } else {
                let d = towards + (f32(2u * x + 1u) / f32(n) - 1.0) * camera.right.xyz;
                patch_here = patch_at(seen, d);
            }
        }
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
