//! The limit of memory counts the search for blocks, too.

use portolan::geom::{Lattice, Pose};
use portolan::map::{MapError, Occupancy};
use portolan::scan::{Pinhole, RangeImage};

/// A camera of so short a focal length that nearly all blocks in reach are in view.
#[test]
fn a_camera_that_sees_everything_ends_at_the_limit() {
    let camera = Pinhole { fx: 0.3, fy: 0.3, cx: 5.5, cy: 4.0 };
    let image = RangeImage::from_depth(camera, 12, 9, vec![2.0; 12 * 9]);
    let map = || Occupancy::<3>::new(Lattice::new([0.0; 3], 0.02), Default::default()).unwrap();
    let mut whole = map();
    whole.integrate(&Pose::IDENTITY, &image).unwrap();
    let mut limited = map();
    // Of what it needs without a limit; a few thousand blocks are free.
    let bricks = whole.store().len();
    assert!(bricks > 3 * 4096, "{bricks}");
    limited.set_limit(1 << 20);
    let refused = limited.integrate(&Pose::IDENTITY, &image);
    assert!(matches!(refused, Err(MapError::Full(_))), "{refused:?}");
    // Found while searching: nothing was fused.
    assert!(limited.store().is_empty());
}
