//! One line a rate.

use std::fmt::Write;

use super::Report;

/// A field in quotes where it needs them (RFC 4180).
pub fn field(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

pub fn write(report: &Report) -> String {
    let mut out = String::from(
        "scene,primitives,accelerator,description,ray_kind,rays,mode,threads,mrays_per_second_median,\
         mrays_per_second_min,mrays_per_second_max,nodes_per_ray,prims_per_ray,build_ms_all_threads,bytes,identical,\
         within_bound,ties,different\n",
    );
    for scene in &report.scenes {
        for accel in &scene.accels {
            let build = accel.builds.last().map_or(0.0, |b| b.milliseconds[0]);
            for kind in &accel.kinds {
                let number = |n: Option<f64>| n.map_or(String::new(), |n| format!("{n:.3}"));
                for rate in &kind.rates {
                    let [median, low, high] = rate.mrays_per_second;
                    let a = &kind.agreement;
                    // Writing to a string cannot fail.
                    let _ = writeln!(
                        out,
                        "{},{},{},{},{},{},{},{},{median:.4},{low:.4},{high:.4},{},{},{build:.3},{},{},{},{},{}",
                        field(&scene.scene),
                        scene.primitives,
                        field(&accel.name),
                        field(&accel.description),
                        kind.kind.name(),
                        kind.rays,
                        rate.mode.name(),
                        rate.threads,
                        number(kind.nodes_per_ray),
                        number(kind.prims_per_ray),
                        accel.bytes,
                        a.identical,
                        a.within_bound,
                        a.ties,
                        a.different,
                    );
                }
            }
        }
    }
    out
}
