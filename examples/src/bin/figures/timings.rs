//! Figure 6: how long injective pulls take.

use std::{fmt::Write as _, time::Instant};

use ffd_core::{Constraint, Grid, InjectiveOptions, StepPolicy};
use serde_json::json;

use crate::{
    Error, Figure, Settings,
    cases::{Case, over_constraint, over_extension},
    comparison::policy_name,
    shapes::Shape,
};

/// Lengths of the constraints, relative to those of figure 7.
const LENGTHS: [(&str, f64); 3] = [("S", 0.5), ("M", 1.0), ("L", 1.5)];

/// The times of the paper in milliseconds, for 145, 545 and 2113 vertices; kinds 1S, 1M, 1L,
/// 2S, 2M, 2L. On an SGI Octane with one R10000 at 195 MHz.
const PAPER_MS: [[f64; 6]; 3] = [
    [12.7, 26.9, 52.2, 25.3, 36.6, 49.2],
    [23.4, 47.2, 88.2, 41.1, 58.8, 77.2],
    [62.3, 124.4, 220.4, 103.9, 148.6, 193.7],
];

/// What one pull took.
struct Timing {
    pull_ms: f64,
    apply_ms: f64,
    steps: usize,
    achieved: f64,
}

pub(crate) fn timings(settings: &Settings) -> Result<Figure, Error> {
    let cases = [over_extension()?, over_constraint()?];
    let mut table = String::from("| vertices | policy |");
    for case in &cases {
        for (length, _) in LENGTHS {
            let _infallible = write!(table, " {}{length} |", case.name);
        }
    }
    table.push_str("\n|---|---|---|---|---|---|---|---|\n");
    let mut rows = Vec::new();
    for (mesh, paper) in PAPER_MS.iter().enumerate() {
        let vertices = cases[0].meshes[mesh].positions.len();
        let _infallible = write!(table, "| {vertices} | paper, 2001 |");
        for ms in paper {
            let _infallible = write!(table, " {ms} ms |");
        }
        table.push('\n');
        for &policy in &settings.policies {
            let _infallible = write!(table, "| {vertices} | {} |", policy_name(policy));
            let mut kinds = serde_json::Map::new();
            for case in &cases {
                for (length, scale) in LENGTHS {
                    let timing = time(case, &case.meshes[mesh], policy, scale, settings.repeats)?;
                    let sum = timing.pull_ms + timing.apply_ms;
                    let part = if timing.achieved < 1.0 {
                        format!(", {:.0} %", 100.0 * timing.achieved)
                    } else {
                        String::new()
                    };
                    let _infallible = write!(table, " {sum:.3} ms ({}{part}) |", timing.steps);
                    let value = json!({
                        "pull_ms": timing.pull_ms,
                        "apply_ms": timing.apply_ms,
                        "steps": timing.steps,
                        "achieved": timing.achieved,
                    });
                    kinds.insert(format!("{}{length}", case.name), value);
                }
            }
            table.push('\n');
            rows.push(json!({
                "vertices": vertices,
                "policy": policy_name(policy),
                "kinds": kinds,
            }));
        }
    }
    table.push_str(
        "\nMedian milliseconds for finding the steps and applying them to all vertices, and in brackets the number of steps. One thread.\n",
    );
    Ok(Figure {
        name: "figure-6",
        title: "Figure 6: timings of injective pulls",
        picture: None,
        table: Some(table),
        numbers: json!({ "paper_ms": PAPER_MS, "rows": rows, "repeats": settings.repeats }),
    })
}

/// Medians of some runs.
fn time(
    case: &Case,
    shape: &Shape,
    policy: StepPolicy,
    scale: f64,
    repeats: usize,
) -> Result<Timing, Error> {
    let constraints: Vec<_> = case
        .constraints
        .iter()
        .map(|c| Constraint::new(c.point, c.displacement.map(|x| scale * x)))
        .collect();
    let (mut pulls, mut applications) = (Vec::new(), Vec::new());
    let mut result = (0, 0.0);
    for _ in 0..repeats {
        let run = run(&case.grid, &constraints, shape, policy)?;
        pulls.push(run.pull_ms);
        applications.push(run.apply_ms);
        result = (run.steps, run.achieved);
    }
    Ok(Timing {
        pull_ms: median(&mut pulls),
        apply_ms: median(&mut applications),
        steps: result.0,
        achieved: result.1,
    })
}

fn run(
    grid: &Grid<3>,
    constraints: &[Constraint<3>],
    shape: &Shape,
    policy: StepPolicy,
) -> Result<Timing, Error> {
    let options = InjectiveOptions {
        policy,
        ..InjectiveOptions::default()
    };
    let mut positions = shape.positions.clone();
    let start = Instant::now();
    let pull = grid.injective_pull(constraints, &options)?;
    let pulled = Instant::now();
    // Each step finds the points at other places, so that binding them does not pay.
    pull.sequence
        .deform_points::<f64, [f64; 3]>(&mut positions)?;
    let applied = pulled.elapsed();
    Ok(Timing {
        pull_ms: 1e3 * (pulled - start).as_secs_f64(),
        apply_ms: 1e3 * applied.as_secs_f64(),
        steps: pull.sequence.lattices().len(),
        achieved: pull.achieved,
    })
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}
