//! What fires do: heights, puffing.

use super::*;

/// Dump for tuning.
#[test]
fn print_fire() {
    let parameters = FlameParticlesParameters::default();
    let mut simulation = simulation(&parameters, 1);
    println!("{:?}", simulation.design.burners.iter().map(|b| (b.height, b.speed, b.rise_time())).collect::<Vec<_>>());
    println!(
        "d {} rates {:?} m {} k {}",
        simulation.design.support_radius,
        simulation.design.rates,
        simulation.design.mass,
        simulation.design.stiffness_per_kelvin
    );
    let start = std::time::Instant::now();
    let mut steps = 0;
    run(&mut simulation, WindParameters::default(), 2.0, |s, t| {
        steps += 1;
        if (t * 120.0).round() as i64 % 12 == 0 {
            let p = &s.particles;
            let mut tops: Vec<f32> = (0..p.len())
                .filter(|i| p.soot[*i] > 3e-7 && p.temperature[*i] > 900.0)
                .map(|i| p.position[1][i])
                .collect();
            tops.sort_by(f32::total_cmp);
            let top = tops.get(tops.len() * 98 / 100).copied().unwrap_or(0.0);
            let speed = (0..p.len()).map(|i| p.velocity[1][i]).fold(0.0, f32::max);
            println!(
                "{t:.2} n {} lit {} top {top:.2} vmax {speed:.1} ms/step {:.2}",
                p.len(),
                tops.len(),
                start.elapsed().as_secs_f64() * 1e3 / f64::from(steps)
            );
        }
    });
    let p = &simulation.particles;
    for band in 0..14 {
        let low = band as f32 * 0.1;
        let inside: Vec<usize> = (0..p.len()).filter(|i| (low..low + 0.1).contains(&p.position[1][*i])).collect();
        let mean = |f: &dyn Fn(usize) -> f32| inside.iter().map(|i| f(*i)).sum::<f32>() / inside.len().max(1) as f32;
        println!(
            "y {low:.1} n {} v {:.2} T {:.0} fuel {:.2} soot {:.2e} rho {:.3} r {:.3} radius {:.3}",
            inside.len(),
            mean(&|i| p.velocity[1][i]),
            mean(&|i| p.temperature[i]),
            mean(&|i| p.fuel[i]),
            mean(&|i| p.soot[i]),
            mean(&|i| p.density[i]),
            mean(&|i| p.position[0][i].hypot(p.position[2][i])),
            mean(&|i| p.support_radius[i])
        );
    }
}
