//! The behaviours of the textbook's last section and of its exercise 7, each on its named seed.
//!
//! The numbers asserted leave room about those observed (in comments): the arithmetic is the same on every
//! platform, the margins are for changes of the settings.

use portolan_chapter::radiance::{
    AMBIGUOUS, Channels, Experiment, Fit, LUCKY, Line, LineRay, Measurement, NamedSeed, OPAQUE, Optimizer,
    Outcome, PARKED, Settings, TWO_NOT_ENOUGH, softplus, softplus_inverse, transmittance,
};

/// What counts as near a surface when matter in empty space is looked for, m.
const MARGIN: f64 = 0.3;

fn run(seed: NamedSeed, channels: Channels) -> Outcome {
    Experiment::default().run(seed.seed, channels).expect("the default settings are valid")
}

fn optical_depth(line: &Line, bin: usize) -> f64 {
    line.density[bin] * line.resolution
}

/// Residual of the noise: 3 cm, with the scatter of seven rays.
fn at_noise_floor(outcome: &Outcome) -> bool {
    outcome.last().training.depth < 1.25 * outcome.fit.settings().noise.depth
}

#[test]
fn chapter19_density_sharpens_only_where_transmittance_survives() {
    let outcome = run(LUCKY, Channels::Depth);
    let Optimizer::GradientDescent { rate } = outcome.fit.settings().optimizer else {
        panic!("plain descent")
    };
    let prior = outcome.fit.settings().prior;
    // What the prior alone does to a bin in all those steps: it pulls θ to its mean by a constant factor.
    let kept = (1.0 - rate / prior.density_spread.powi(2)).powi(outcome.fit.steps() as i32);
    let (mut hidden, mut cleared, mut solid) = (0, 0, 0);
    for bin in 0..outcome.start.bins() {
        let (before, after) = (optical_depth(&outcome.start, bin), optical_depth(outcome.fit.line(), bin));
        let by_prior = softplus(prior.density_mean + (softplus_inverse(before) - prior.density_mean) * kept);
        if outcome.reach[bin] < 1e-5 {
            // No light, no news: the bin is where the prior leaves it.
            assert!((after - by_prior).abs() < 1e-3, "bin {bin}: {after} instead of {by_prior}");
            hidden += 1;
        } else if outcome.reach[bin] > 0.9 {
            cleared += usize::from(after < 0.2 * before);
            solid += usize::from(after > 1.0);
        }
    }
    assert!(hidden >= 2 && cleared > 60, "{hidden} hidden, {cleared} cleared");
    // The wall at 7.6 m was fog at the start; the bin in front of it became it.
    assert!(solid >= 1 && optical_depth(&outcome.start, 75) < 0.05, "{solid} solid");
    // 0.024 m, 0.074 m.
    assert!(at_noise_floor(&outcome) && outcome.last().held_out.depth < 0.15);
}

#[test]
fn chapter19_training_reaches_the_noise_and_held_out_rays_do_not() {
    let outcome = run(AMBIGUOUS, Channels::Depth);
    let (first, last) = (outcome.curve[0], outcome.last());
    // 0.024 m against 1.230 m.
    assert!(at_noise_floor(&outcome) && first.training.depth > 0.5, "{first:?}");
    assert!(last.held_out.depth > 30.0 * last.training.depth, "{last:?}");
    // With the reflectance the same start and the same noise leave no such freedom: 0.066 m.
    let two = run(AMBIGUOUS, Channels::DepthReflectance);
    assert!(at_noise_floor(&two) && two.last().held_out.depth < 0.1, "{:?}", two.last());
}

#[test]
fn chapter19_exercise7_two_channels_beat_one() {
    let experiment = Experiment::default();
    let stuck = run(PARKED, Channels::Depth);
    let bin = stuck.worst_bin(&experiment.scene, MARGIN).unwrap();
    // The start put a solid clump into empty space; seven rays are content with what is left of it.
    assert!(optical_depth(&stuck.start, bin) > 5.0);
    assert!(optical_depth(stuck.fit.line(), bin) > 0.5);
    assert!(at_noise_floor(&stuck) && stuck.last().held_out.depth > 2.0, "{:?}", stuck.last());
    // It stays: twice the steps change nothing.
    let longer = Experiment { steps: 2 * experiment.steps, ..experiment.clone() };
    let longer = longer.run(PARKED.seed, Channels::Depth).unwrap();
    assert!(optical_depth(longer.fit.line(), bin) > 0.5 && longer.last().held_out.depth > 2.0);

    // The same start, the same noise, and the reflectance: 2.784 m becomes 0.293 m.
    let free = run(PARKED, Channels::DepthReflectance);
    assert!(optical_depth(free.fit.line(), bin) < 0.02);
    assert!(free.last().held_out.depth < 0.15 * stuck.last().held_out.depth, "{:?}", free.last());
    // It even frees the field on which depth had got stuck: 0.235 m.
    let freed =
        experiment.run_from(stuck.fit.line().clone(), PARKED.seed, Channels::DepthReflectance).unwrap();
    assert!(optical_depth(freed.fit.line(), bin) < 0.02);
    assert!(freed.last().held_out.depth < 0.15 * stuck.last().held_out.depth, "{:?}", freed.last());
}

#[test]
fn chapter19_exercise7_the_term_that_reflectance_repairs() {
    let experiment = Experiment::default();
    let stuck = run(PARKED, Channels::Depth);
    let bin = stuck.worst_bin(&experiment.scene, MARGIN).unwrap();
    // Depth has leverage, meters of it, and light passes; but bin and far plane balance, so no residual
    // uses it.
    let terms = stuck.fit.explain(bin);
    assert_eq!(terms.len(), 5);
    for t in &terms {
        assert!(t.depth.contrast < -2.0 && t.passes > 0.1 && t.depth.residual.abs() < 1.5, "{t:?}");
    }
    let (net, gross) = terms.iter().fold((0.0, 0.0), |s, t| (s.0 + t.depth.pull, s.1 + t.depth.pull.abs()));
    assert!(net.abs() < 0.01 * gross, "net {net} of {gross}");
    // A little into the second channel: its bracket does not balance, and asks for less density.
    let begun = Experiment { steps: 500, ..experiment };
    let begun = begun.run_from(stuck.fit.line().clone(), PARKED.seed, Channels::DepthReflectance).unwrap();
    let terms = begun.fit.explain(bin);
    let pull: f64 = terms.iter().map(|t| t.reflectance.pull).sum();
    assert!(pull > 5.0, "{pull}");
    assert!(terms.iter().any(|t| t.reflectance.residual.abs() > 10.0));
}

#[test]
fn chapter19_exercise7_two_channels_are_not_always_enough() {
    let two = run(TWO_NOT_ENOUGH, Channels::DepthReflectance);
    let noise = two.fit.settings().noise;
    // Both channels are at their noise (0.012 m, 0.032), held-out depth is not (0.913 m): where surfaces
    // are gray, a dark clump in front of a bright wall has the right mean distance and the right mean
    // color at once.
    assert!(at_noise_floor(&two) && two.last().training.reflectance < 1.25 * noise.reflectance);
    assert!(two.last().held_out.depth > 0.5, "{:?}", two.last());
    let bin = two.worst_bin(&Experiment::default().scene, MARGIN).unwrap();
    assert!(optical_depth(two.fit.line(), bin) > 0.3);
    let in_the_room = two.fit.explain(bin).into_iter().filter(|t| t.passes > 0.5);
    let seen = in_the_room.fold([0.0_f64; 3], |worst, t| {
        let residuals = [t.depth.residual, t.reflectance.residual, t.second_moment.residual];
        [0, 1, 2].map(|c| worst[c].max(residuals[c].abs()))
    });
    // 0.7, 0.9 and 32 standard deviations: the third would see it.
    assert!(seen[0] < 2.0 && seen[1] < 2.0 && seen[2] > 20.0, "{seen:?}");
    // What a third has to measure is how far the return is spread along the ray (0.077 m).
    let three = run(TWO_NOT_ENOUGH, Channels::DepthReflectanceSpread);
    assert!(at_noise_floor(&three) && three.last().held_out.depth < 0.15, "{:?}", three.last());
}

#[test]
fn chapter19_an_invented_opaque_bin_stays_in_any_channel() {
    let scene = Experiment::default().scene;
    for channels in [Channels::Depth, Channels::DepthReflectance, Channels::DepthReflectanceSpread] {
        let outcome = run(OPAQUE, channels);
        let bin = outcome.worst_bin(&scene, MARGIN).unwrap();
        assert!(optical_depth(outcome.fit.line(), bin) > 5.0, "{channels:?}");
        assert!(outcome.last().training.depth > 1.0, "{channels:?}: {:?}", outcome.last());
        // Nothing passes, and that factor is the same in every channel.
        assert!(outcome.fit.explain(bin).iter().all(|t| t.passes < 5e-3), "{channels:?}");
    }
}

#[test]
fn transmittance_falls_along_a_ray() {
    let scene = Experiment::default().scene;
    let along = transmittance(&scene.truth(), &LineRay { origin: 2.0, ascending: true });
    assert_eq!(along.len(), 61);
    assert!(along.windows(2).all(|pair| pair[1] <= pair[0]));
    // Empty to the pillar at 4.6 m, dark behind it.
    assert_eq!(along[26], 1.0);
    assert!(along[60] < 1e-15);
}

#[test]
fn steps_allocate_nothing() {
    for optimizer in [Optimizer::GradientDescent { rate: 1e-4 }, Optimizer::adam(0.02)] {
        let channels = Channels::DepthReflectanceSpread;
        let scene = Experiment::default().scene;
        let settings = Settings { channels, optimizer, ..Settings::default() };
        let (training, held_out): (Vec<Measurement>, Vec<Measurement>) = scene.measure(&settings.noise, 1);
        let mut fit = Fit::new(scene.random_start(1), &training, settings).unwrap();
        let count = allocation_counter::measure(|| {
            for _ in 0..10 {
                fit.step();
                fit.residuals(&held_out);
            }
        });
        assert_eq!(count.count_total, 0, "{optimizer:?}");
    }
}
