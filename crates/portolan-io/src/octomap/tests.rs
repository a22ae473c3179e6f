use std::path::Path;

use portolan::cell::{LogOdds8, LogOdds32, LogOddsRule, OccupancyModel};
use portolan::geom::{BlockKey, Lattice};
use portolan::store::{Bricks, Slot, Store, Tree, TreeRecords};

use super::*;
use crate::Compression;
use crate::testing::{Random, bad_bytes, real_data, written};

fn parse(bytes: &[u8]) -> Result<OctomapTree, crate::IoError> {
    OctomapTree::parse(bytes, Path::new("t.bt"))
}

fn error(bytes: &[u8]) -> String {
    let error = parse(bytes).unwrap_err().to_string();
    assert!(!error.contains('\n'));
    error
}

fn bt(size: u64, words: &[u16]) -> Vec<u8> {
    let mut bytes = format!(
        "# Octomap OcTree binary file\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n\
         id OcTree\nsize {size}\nres 0.1\ndata\n"
    )
    .into_bytes();
    bytes.extend(words.iter().flat_map(|w| w.to_le_bytes()));
    bytes
}

/// Nodes: log odds and the mask of children.
fn ot(class: &str, nodes: &[(f32, u8)]) -> Vec<u8> {
    let mut bytes = format!(
        "# Octomap OcTree file\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n\
         id {class}\nsize {}\nres 0.1\ndata\n",
        nodes.len()
    )
    .into_bytes();
    bytes.extend(nodes.iter().flat_map(|(value, mask)| {
        let color: &[u8] = if class == "ColorOcTree" { &[1, 2, 3] } else { &[] };
        [&value.to_le_bytes()[..], color, &[*mask]].concat()
    }));
    bytes
}

/// Fifteen inner nodes down to the two finest levels about the world's zero: at each the child next to it.
fn spine() -> Vec<u16> {
    // The root's child 7 is the upper octant; in it child 0 is next to zero, all the way down.
    let mut words = vec![3 << 14];
    words.extend([3; 14]);
    words
}

#[test]
fn a_binary_file_byte_by_byte() {
    // The finest inner node, cells (0..2)^3: free, occupied, unknown, free, unknown x 4.
    let mut words = spine();
    words.push(0b01_00_10_01);
    let bytes = bt(16 + 3, &words);
    let file = parse(&bytes).unwrap();
    assert_eq!(
        (file.leaves(), file.inner_nodes(), file.class(), file.is_binary()),
        ((2, 1), 16, "OcTree", true)
    );
    let tree = file.tree();
    tree.check_invariants();
    let at = |cell: [i32; 3]| tree.cell(cell.map(|v| v + HALF)).map(|v| v.0);
    assert_eq!(at([0, 0, 0]), Some(OCTOMAP_FREE));
    assert_eq!(at([1, 0, 0]), Some(OCTOMAP_OCCUPIED));
    assert_eq!((at([0, 1, 0]), at([-1, 0, 0]), at([0, 0, 1])), (None, None, None));
    assert_eq!(at([1, 1, 0]), Some(OCTOMAP_FREE));
    assert_eq!(tree.lattice().cell_of([0.15, 0.05, 0.05]), Some([HALF + 1, HALF, HALF]));
    assert_eq!(written(|p| file.write_bt(p)), bytes);
    // The same cells, fused elsewhere: a small tree whose origin is no multiple of eight cells.
    let small = tree.moved_to([HALF - 3, HALF - 5, HALF], 3).unwrap();
    assert_eq!(written(|p| write_octomap_bt(p, &small)), bytes);
    assert_eq!(octomap_bt_to_bytes(&small).unwrap(), bytes);
    let p = |l: f32| 1.0 / (1.0 + (-f64::from(l)).exp());
    assert!((p(OCTOMAP_FREE) - 0.1192).abs() < 1e-7 && (p(OCTOMAP_OCCUPIED) - 0.971).abs() < 1e-7);
}

#[test]
fn a_full_file_byte_by_byte() {
    // The root with two leaves of an octant each and one inner octant with one leaf.
    let nodes = [(0.85, 0b1000_0011), (-0.4, 0), (0.85, 0), (-2.0, 0b10), (-2.0, 0)];
    for class in ["OcTree", "OcTreeStamped"] {
        let bytes = ot(class, &nodes);
        let file = parse(&bytes).unwrap();
        assert_eq!((file.leaves(), file.inner_nodes(), file.prunable_nodes()), ((2, 1), 2, 0));
        assert_eq!(file.tree().cell([0; 3]), Some(LogOdds32(-0.4)));
        assert_eq!(file.tree().cell([HALF, 0, 0]), Some(LogOdds32(0.85)));
        assert_eq!(file.tree().cell([HALF + HALF / 2, HALF, HALF]), Some(LogOdds32(-2.0)));
        assert_eq!(file.tree().cell([HALF; 3]), None);
        assert_eq!(written(|p| file.write_ot(p)), bytes);
        let as_binary = parse(&written(|p| file.write_bt(p))).unwrap();
        assert_eq!((as_binary.leaves(), as_binary.class()), ((2, 1), class));
    }
    let colored = parse(&ot("ColorOcTree", &nodes)).unwrap();
    assert!(colored.colors_left_out() && colored.leaves() == (2, 1));
    assert_eq!(written(|p| colored.write_ot(p)), ot("OcTree", &nodes));
}

#[test]
fn values_of_inner_nodes_and_nodes_that_could_be_merged_are_kept() {
    let eight = |value: f32| [(value, 0); 8];
    // Root: a stale value; children: an inner node of eight equal ones, one of them inner again; a leaf; an inner node
    // with the value NaN.
    let mut nodes = vec![(7.0, 0b1000_0101), (0.25, 0xff), (0.25, 0xff)];
    nodes.extend(eight(0.25));
    nodes.extend(&eight(0.25)[..7]);
    nodes.extend([(-1.5, 0), (f32::NAN, 0b11), (0.0, 0), (-0.0, 0)]);
    let bytes = ot("OcTree", &nodes);
    let file = parse(&bytes).unwrap();
    file.tree().check_invariants();
    assert_eq!((file.inner_nodes(), file.prunable_nodes(), file.tree().inner_nodes()), (4, 2, 2));
    assert_eq!(file.leaves(), (1, 15 + 2));
    assert_eq!(file.tree().max_at([0; 3], 16), Some(LogOdds32(0.25)));
    assert_eq!(written(|p| file.write_ot(p)), bytes);
    // What was merged stays merged in a binary file: the root, two leaves and a third whose two are equal but not all.
    let binary = parse(&written(|p| file.write_bt(p))).unwrap();
    assert_eq!((binary.leaves(), binary.inner_nodes()), ((1, 3), 2));
    // A root whose leaves are all equal.
    let mut nodes = vec![(3.0, 0xff)];
    nodes.extend(eight(3.0));
    let bytes = ot("OcTree", &nodes);
    let file = parse(&bytes).unwrap();
    assert_eq!((file.tree().nodes(), file.prunable_nodes()), (1, 1));
    assert_eq!(written(|p| file.write_ot(p)), bytes);
    assert_eq!(written(|p| write_octomap_ot(p, file.tree(), 1.0)), ot("OcTree", &nodes[1..2]));
    let root_of_leaves = bt(9, &[0xaaaa]);
    assert_eq!(written(|p| file.write_bt(p)), root_of_leaves);
    assert_eq!(written(|p| parse(&root_of_leaves).unwrap().write_bt(p)), root_of_leaves);
}

#[test]
fn empty_trees() {
    let tree = Tree::<LogOdds8, 3>::new([5.0; 3], 0.1, 3).unwrap();
    for (bytes, expected) in [
        (written(|p| write_octomap_bt(p, &tree)), bt(0, &[])),
        (written(|p| write_octomap_ot(p, &tree, 1.0)), ot("OcTree", &[])),
    ] {
        assert_eq!(bytes, expected);
        let file = parse(&bytes).unwrap();
        assert_eq!((file.leaves(), file.inner_nodes(), file.tree().nodes()), ((0, 0), 0, 0));
    }
}

/// Bricks with all values of a byte.
fn fused(first: [i32; 3], origin: [f64; 3]) -> Tree<LogOdds8, 3> {
    let mut random = Random(7);
    let mut bricks = Bricks::<LogOdds8, 3>::new(Lattice::new(origin, 0.1));
    for _ in 0..40 {
        let key = BlockKey(std::array::from_fn(|k| first[k] + random.below(5) as i32 - 2));
        let mut brick =
            <portolan::cell::LogOddsBrick<LogOdds8> as portolan::cell::Planes<_>>::unobserved(512);
        let kind = random.below(3);
        for cell in brick.cells_mut() {
            *cell = LogOdds8([random.next() as i8, -73, if random.below(2) > 0 { 127 } else { -128 }][kind]);
        }
        bricks.insert(key, brick).unwrap();
    }
    Tree::from_bricks(&bricks).unwrap()
}

#[test]
fn what_was_fused_comes_back_from_both_formats() {
    let quantum = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap().quantum;
    let tree = fused([0; 3], [0.0, -0.3, 1_000.0]);
    let shift = tree.lattice().origin.map(|v| (v / 0.1).round() as i32 + HALF);
    let full = parse(&written(|p| write_octomap_ot(p, &tree, quantum))).unwrap();
    let binary = parse(&written(|p| write_octomap_bt(p, &tree))).unwrap();
    assert_eq!((full.prunable_nodes(), binary.prunable_nodes()), (0, 0));
    full.tree().check_invariants();
    binary.tree().check_invariants();
    let (mut seen, n) = (0, 1 << tree.depth());
    for i in 0..n * n * n {
        let cell = [i % n, i / n % n, i / n / n];
        let there: [i32; 3] = std::array::from_fn(|k| cell[k] + shift[k]);
        let value = tree.cell(cell);
        seen += usize::from(value.is_some());
        assert_eq!(full.tree().cell(there), value.map(|v| LogOdds32((f64::from(v.0) * quantum) as f32)));
        let label = value.map(|v| LogOdds32(if v.0 >= 0 { OCTOMAP_OCCUPIED } else { OCTOMAP_FREE }));
        assert_eq!(binary.tree().cell(there), label);
    }
    assert!(seen > 5_000);
    // Floats go through without a change of a bit.
    assert_eq!(written(|p| write_octomap_ot(p, full.tree(), 1.0)), written(|p| full.write_ot(p)));
    assert_eq!(written(|p| write_octomap_bt(p, full.tree())), written(|p| full.write_bt(p)));
}

#[test]
fn what_octomap_cannot_hold_is_refused() {
    let refused = |tree: &Tree<LogOdds8, 3>| {
        let errors = [write_octomap_bt("never.bt", tree), write_octomap_ot("never.bt", tree, 1.0)];
        let [a, b] = errors.map(|e| e.unwrap_err().to_string());
        assert_eq!(a, b);
        a
    };
    let off = refused(&fused([0; 3], [0.05, 0.0, 0.0]));
    assert!(
        off.contains("never.bt: the origin of the map is") && off.contains("multiple of the resolution"),
        "{off}"
    );
    let outside = refused(&fused([4096, 0, 0], [0.0; 3]));
    assert!(
        outside.contains("the observed box is from [") && outside.contains("from -32768 to 32768"),
        "{outside}"
    );
    assert!(refused(&fused([0; 3], [500_000.0, 4_000_000.0, 0.0])).contains("the observed box"));
    // The outermost cells are still held.
    let mut records = TreeRecords::new();
    records.set_root(Slot::Leaf(LogOdds8(1)));
    let corner = |first: f64| Tree::<LogOdds8, 3>::from_records([first * 0.1; 3], 0.1, 3, &records).unwrap();
    for first in [-32_768.0, 32_760.0] {
        let file = parse(&written(|p| write_octomap_bt(p, &corner(first)))).unwrap();
        let (low, high) = file.tree().extent().unwrap();
        assert_eq!((low, high), ([first as i32 + HALF; 3], [first as i32 + 8 + HALF; 3]));
    }
    for first in [-32_769.0, 32_761.0] {
        assert!(refused(&corner(first)).contains("the observed box"));
    }
    let infinite = write_octomap_ot("never.ot", &corner(0.0), f64::INFINITY).unwrap_err().to_string();
    assert!(infinite.contains("a log odds is inf"), "{infinite}");
}

#[test]
fn damaged_files_are_refused_in_one_line() {
    let mut deep = spine();
    deep.push(3);
    let mut good = spine();
    good.push(1);
    let mut longer = bt(17, &good);
    longer.push(b'\n');
    let chain = |n: usize, last: f32| {
        let mut nodes = vec![(0.5, 1u8); n];
        nodes.push((last, 0));
        nodes
    };
    assert_eq!(parse(&bt(17, &good)).unwrap().leaves(), (1, 0));
    assert!(parse(&ot("OcTree", &chain(16, 0.5))).is_ok());
    for (bytes, part) in [
        (bt(17, &deep), "t.bt: byte 167: the depth of a node is 17"),
        (bt(18, &good), "the number of nodes is 17; the header announces 18"),
        (bt(16, &good), "byte 167: the number of nodes is at least 17; the header announces 16"),
        (bt(17, &good[..9]), "the number of nodes is 10 so far; the file ends"),
        (longer, "byte 169: the data after the last node is \"?\""),
        (bt(2, &[3, 0]), "byte 138: the number of children of an inner node is 0"),
        (bt(1, &[0]), "the number of children of an inner node is 0"),
        (ot("OcTree", &chain(17, 0.5)), "the depth of a node is 17"),
        (ot("OcTree", &chain(3, f32::NAN)), "the log odds of a leaf is NaN"),
        (ot("OcTree", &chain(3, f32::INFINITY)), "the log odds of a leaf is inf"),
        (ot("CountingOcTree", &chain(3, 1.0)), "the class (id) is \"CountingOcTree\""),
    ] {
        let text = error(&bytes);
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn nodes_are_charged_before_memory_is_taken() {
    let mut words = spine();
    words.push(1);
    let bytes = bt(17, &words);
    // Sixteen inner nodes are held at once.
    let within = |memory: u64, packed| {
        let read = read::read_within(&bytes[..], packed, Path::new("t.bt"), memory);
        read.map(|file| file.inner_nodes()).map_err(|e| e.to_string())
    };
    assert_eq!(within(16 * NODE_MEMORY, Compression::Gzip), Ok(16));
    let error = within(16 * NODE_MEMORY - 1, Compression::Gzip).unwrap_err();
    let part =
        "t.bt: byte 167: the memory of the nodes is more than 0 MiB; that is the limit of a packed file";
    assert!(error.contains(part), "{error}");
    assert!(within(NODE_MEMORY, Compression::Plain).unwrap_err().contains("split the tree"));
    // Nodes that are merged at once are not held: an inner node of eight with eight equal leaves each.
    let mut words = vec![0xffff];
    words.extend([0x5555; 8]);
    let merged = bt(73, &words);
    let file =
        read::read_within(&merged[..], Compression::Bzip2, Path::new("t.bt"), 2 * NODE_MEMORY).unwrap();
    assert_eq!((file.inner_nodes(), file.tree().inner_nodes()), (9, 0));
    assert_eq!(written(|p| file.write_bt(p)), merged);
}

#[test]
fn no_bytes_make_it_panic_and_all_that_is_read_is_written_back() {
    let mut words = spine();
    words.push(0b01_00_10_01);
    let mut nodes = vec![(1.0, 0xff); 3];
    nodes.extend([(1.0, 0); 22]);
    let mut again = 0;
    for good in [bt(19, &words), ot("OcTree", &nodes), ot("ColorOcTree", &nodes)] {
        for bytes in bad_bytes(&good, 11, 4000) {
            let Ok(file) = parse(&bytes) else { continue };
            file.tree().check_invariants();
            let back = match file.is_binary() {
                true => written(|p| file.write_bt(p)),
                false => written(|p| file.write_ot(p)),
            };
            assert!(file.colors_left_out() || back == bytes);
            again += 1;
        }
    }
    assert!(again > 500, "{again}");
}

#[test]
fn files_of_others_come_back_to_the_byte() {
    for (name, class, leaves, inner, prunable) in [
        ("maps_octomap/geb079.bt", "OcTree", (284_415, 143_729), 104_422, 0),
        ("maps_octomap/freiburg1_360.bt", "ColorOcTree", (713_432, 563_449), 270_231, 0),
        ("lidar3d_la3dm_sim_structured/map.bt", "OcTree", (124_648, 13_829), 32_810, 4_931),
    ] {
        let Some(path) = real_data(name) else { continue };
        let file = OctomapTree::read(&path).unwrap();
        assert_eq!((file.class(), file.leaves(), file.inner_nodes()), (class, leaves, inner), "{name}");
        assert_eq!(file.prunable_nodes(), prunable);
        file.tree().check_invariants();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(written(|p| file.write_bt(p)), bytes, "{name}");
        // Through an .ot nothing is lost either: nodes and comments are the same again, after OctoMap's pruning.
        let full = parse(&written(|p| file.write_ot(p))).unwrap();
        assert_eq!((full.leaves(), full.inner_nodes()), (leaves, inner));
        if prunable == 0 && class == "OcTree" {
            assert_eq!(written(|p| full.write_bt(p)), bytes, "{name}");
        }
    }
}
