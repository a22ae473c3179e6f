//! One step of gradient descent over ten rays x 80 bins: render, differentiate, move. The allocation
//! columns must stay at zero.

use divan::{AllocProfiler, Bencher};
use portolan_chapter::radiance::{Channels, Fit, Line, LineRay, Measurement, Optimizer, Settings};

#[global_allocator]
static ALLOC: AllocProfiler = AllocProfiler::system();

fn main() {
    divan::main();
}

/// Ten rays that start outside of the line, so that each crosses all 80 bins: 800 samples.
fn fit(channels: Channels, optimizer: Optimizer) -> Fit {
    let rays: Vec<Measurement> = (0..10)
        .map(|i| {
            let ascending = i % 2 == 0;
            let outside = 0.05 * (i + 1) as f64;
            let origin = if ascending { -outside } else { 8.0 + outside };
            let depth = 4.0 + outside;
            Measurement {
                ray: LineRay { origin, ascending },
                depth,
                reflectance: 0.7,
                second_moment: depth * depth,
            }
        })
        .collect();
    // Translucent everywhere, so that every bin takes part.
    let line = Line::uniform(0.0, 0.1, 80, 0.5, 0.5);
    let fit = Fit::new(line, &rays, Settings { channels, optimizer, ..Settings::default() });
    let fit = fit.expect("the settings are the default ones");
    assert_eq!(fit.samples_per_step(), 800);
    fit
}

#[divan::bench]
fn gradient_descent_step_depth(bencher: Bencher<'_, '_>) {
    let mut fit = fit(Channels::Depth, Optimizer::GradientDescent { rate: 1e-6 });
    bencher.bench_local(|| fit.step());
}

#[divan::bench]
fn gradient_descent_step_depth_reflectance(bencher: Bencher<'_, '_>) {
    let mut fit = fit(Channels::DepthReflectance, Optimizer::GradientDescent { rate: 1e-6 });
    bencher.bench_local(|| fit.step());
}

#[divan::bench]
fn adam_step_depth_reflectance(bencher: Bencher<'_, '_>) {
    let mut fit = fit(Channels::DepthReflectance, Optimizer::adam(1e-6));
    bencher.bench_local(|| fit.step());
}
