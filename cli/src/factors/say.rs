//! What `hemicube factors` says of a matrix.

use hemicube::matrix::{MatrixReport, NamedRow};

use super::losses;
use crate::terminal::say;

/// Says what the matrix is like.
pub fn report(r: &MatrixReport, verbose: bool) {
    let per_cent = 100.0 * r.entries as f64 / (r.rows as f64).powi(2).max(1.0);
    let mut line = format!(
        "{}: {} faces, {} rows, {} form factors ({per_cent:.1} % of all pairs)",
        r.scene, r.source_triangles, r.rows, r.entries
    );
    for (count, kind) in
        [(r.degenerate, "degenerate"), (r.duplicate, "duplicate"), (r.transparent, "transparent")]
    {
        if count > 0 {
            line += &format!(", {count} {kind} faces without factors");
        }
    }
    if let (Some(groups), Some(kind)) = (r.groups, r.grouped_by) {
        line += &format!(", lumped to {groups} {kind}s");
    }
    say(&line);
    if r.faces_outwards {
        say("note: most faces see nothing while their backs see surfaces: this is the matrix of \
             bodies seen from outside; if it should be a room, turn its faces round with --flip, \
             or use --sides two");
    }
    if let Some(a) = r.account {
        say(&format!(
            "rows: on average {:.5} to faces, {:.5} to the environment, {:.5} to backs{}",
            a.entries_share,
            a.environment,
            a.back,
            a.reciprocity_rms.map_or(String::new(), reciprocity)
        ));
    }
    if let Some(lost) = &r.lost {
        say(&format!(
            "rows: what is missing to 1 is {:.1e} on average, at most {:+.1e} (row {} of {})",
            lost.mean, lost.worst.value, lost.worst.row, lost.worst.surface
        ));
    }
    if let Some(p) = r.pairs {
        say(&format!(
            "pairs: {} evaluated, {} of them with something in between ({:.1} %), {} shadow rays; \
             error about {:.2} % (RMS over all factors, or what a row exceeds 1 by); coordinates \
             taken as rounded to {:.0e} m",
            p.evaluated,
            p.partly_hidden,
            100.0 * p.partly_hidden as f64 / p.evaluated.max(1) as f64,
            p.shadow_rays,
            100.0 * p.error,
            p.rounding
        ));
    }
    if r.through_a_file {
        say("memory: rows went through a temporary file, as all do not fit (--memory)");
    }
    if let Some(found) = &r.losses {
        losses::lines(found, r.covered.len(), verbose).iter().for_each(|line| say(line));
    }
    if let Some(t) = r.threshold {
        say(&format!("threshold: {} form factors below {} dropped", t.dropped, t.below));
    }
    if let Some(c) = &r.closure {
        say(&format!(
            "enclosure: rows sum to 1 within {:.0e} after {} steps; scales from {:.4} to {:.4}; \
             {:.2} % \
             RMS of asymmetry averaged out",
            c.residual.max(f64::EPSILON),
            c.steps,
            c.smallest_scale,
            c.largest_scale,
            100.0 * c.asymmetry
        ));
        name_rows("covered (most of their view is the back of something)", &r.covered, verbose);
        name_rows("scaled by less than .9 or more than 1.1", &c.outside, verbose);
    }
    if verbose {
        stages(r);
    }
}

/// How far factors of a pair are from agreeing.
fn reciprocity(rms: f64) -> String {
    /// Single precision leaves this much between two roundings of a number.
    const ROUNDING: f64 = f32::EPSILON as f64;
    match rms <= ROUNDING {
        true => String::from("; reciprocal to the last digit stored"),
        false => format!("; reciprocity error {:.2} % RMS", 100.0 * rms),
    }
}

fn stages(report: &MatrixReport) {
    for stage in &report.stages {
        say(&format!("{:14} {:8.3} s", stage.name, stage.seconds));
    }
}

/// Says of which rows something is to be said: the first of them; the report names all.
fn name_rows(what: &str, rows: &[NamedRow], verbose: bool) {
    if rows.is_empty() {
        return;
    }
    let shown = rows.len().min(if verbose { 32 } else { 4 });
    let names: Vec<String> = rows[..shown]
        .iter()
        .map(|r| format!("{} of {} ({:.3})", r.row, r.surface, r.value))
        .collect();
    let more = match rows.len() - shown {
        0 => String::new(),
        more => format!(" and {more} more (--report names all)"),
    };
    say(&format!("{} rows {what}: {}{more}", rows.len(), names.join(", ")));
}
