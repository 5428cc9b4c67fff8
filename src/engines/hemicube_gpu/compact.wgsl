// Gathers the patches of each row that were seen, ascending, with their form factors.

struct Job {
    resolution: u32,
    first_source: u32,
    first: u32,
    count: u32,
    stride: u32,
    owned: u32,
    looked: u32,
}

struct Summary {
    // Entries of all rows.
    total: atomic<u32>,
    // Of each row: where its entries begin, how many there are, the environment, backs.
    rows: array<vec4<u32>>,
}

@group(0) @binding(0) var<uniform> job: Job;
@group(0) @binding(1) var<storage, read> sums: array<u32>;
@group(0) @binding(2) var<storage, read_write> summary: Summary;
@group(0) @binding(3) var<storage, read_write> entries: array<vec2<u32>>;

const THREADS: u32 = 256u;

var<workgroup> counts: array<u32, THREADS>;
var<workgroup> start: u32;

// One workgroup a row; each invocation has its own range of columns, so that order is kept. Where a
// row's entries begin depends on who comes first; what they are does not.
@compute @workgroup_size(THREADS)
fn compact(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = group.x;
    let sums_at = row * job.stride;
    let share = (job.count + THREADS - 1u) / THREADS;
    let low = min(thread * share, job.count);
    let high = min(low + share, job.count);

    var mine = 0u;
    for (var k = low; k < high; k += 1u) {
        mine += u32(sums[sums_at + k] > 0u);
    }
    counts[thread] = mine;
    workgroupBarrier();
    for (var step = 1u; step < THREADS; step *= 2u) {
        var before = 0u;
        if thread >= step {
            before = counts[thread - step];
        }
        workgroupBarrier();
        counts[thread] += before;
        workgroupBarrier();
    }

    if thread == THREADS - 1u {
        let account = sums_at + job.stride;
        start = atomicAdd(&summary.total, counts[thread]);
        summary.rows[row] = vec4(start, counts[thread], sums[account - 2u], sums[account - 1u]);
    }
    workgroupBarrier();

    var at = start + counts[thread] - mine;
    for (var k = low; k < high; k += 1u) {
        let sum = sums[sums_at + k];
        if sum > 0u {
            entries[at] = vec2(job.first + k, sum);
            at += 1u;
        }
    }
}
