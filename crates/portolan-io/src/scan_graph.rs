//! OctoMap's scan graphs (`.graph`): scans in the sensor's frame, each with its pose.
//!
//! Little-endian: u32 nodes; of each node: u32 points, each `[u32 3, f64 x, y, z]`; pose `[u32 3, f64 x, y, z]`
//! `[u32 4, f64 w, x, y, z]`; u32 id. After the nodes u32 edges, which record how scans were matched; they are passed over.

use std::path::Path;

use portolan::geom::Pose;

use crate::bytes::{Endian, Input, Scalar, open};
use crate::points::{CloudBuilder, PointCloudFile, most_bytes};
use crate::{IoError, Result};

/// One scan of a graph.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanGraphNode {
    /// Its number in the edges.
    pub id: u32,
    /// Where the sensor stood.
    pub world_from_sensor: Pose<3>,
    /// Points in the sensor's frame.
    pub cloud: PointCloudFile,
}

/// Reads the scans of a graph, in the file's order.
///
/// # Errors
/// [`IoError::Binary`] for a file that is cut off, for lengths that are not those of points and poses, and for a pose that
/// is not finite.
pub fn read_scan_graph(path: impl AsRef<Path>) -> Result<Vec<ScanGraphNode>> {
    parse_scan_graph(open(path)?)
}

/// [`read_scan_graph`] from any input.
///
/// # Errors
/// As [`read_scan_graph`].
pub fn parse_scan_graph(mut input: Input) -> Result<Vec<ScanGraphNode>> {
    let bytes = input.read_all(most_bytes(&input))?;
    let mut reader = Reader { bytes: &bytes, at: 0, path: input.path() };
    let count = reader.u32("the number of scans")?;
    // Every node takes bytes, so that a wrong count ends at the end of the file.
    let mut nodes = Vec::new();
    for _ in 0..count {
        nodes.push(reader.node()?);
    }
    reader.u32("the number of edges")?;
    Ok(nodes)
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    path: &'a Path,
}

impl Reader<'_> {
    fn node(&mut self) -> Result<ScanGraphNode> {
        let points = self.u32("the number of points")?;
        let mut builder = CloudBuilder::new(true);
        for i in 0..points {
            builder.push(i as usize, self.vector("a point")?);
        }
        let start = self.at as u64;
        let translation = self.vector::<3>("the position")?;
        let [w, x, y, z] = self.vector("the rotation")?;
        let finite = translation.iter().all(|v| v.is_finite());
        let pose = Pose::from_quaternion(translation, [x, y, z, w]).filter(|_| finite);
        let Some(world_from_sensor) = pose else {
            let value = format!("{translation:?}, {:?}", [w, x, y, z]);
            let advice = "give finite numbers and a quaternion that is not zero";
            return Err(IoError::binary(self.path, start, "a pose", value, advice));
        };
        let id = self.u32("the id of a scan")?;
        Ok(ScanGraphNode { id, world_from_sensor, cloud: builder.finish() })
    }

    /// A vector of doubles behind its length.
    fn vector<const N: usize>(&mut self, field: &str) -> Result<[f64; N]> {
        let start = self.at as u64;
        let length = self.u32(field)?;
        if length as usize != N {
            let value = format!("{length} numbers");
            let advice = format!("{N} are expected: the file is not a scan graph, or damaged");
            return Err(IoError::binary(self.path, start, field, value, advice));
        }
        let bytes = self.take(8 * N, field)?;
        Ok(std::array::from_fn(|k| Scalar::F64.read(&bytes[8 * k..], Endian::Little)))
    }

    fn u32(&mut self, field: &str) -> Result<u32> {
        Ok(Scalar::U32.read(self.take(4, field)?, Endian::Little) as u32)
    }

    fn take(&mut self, count: usize, field: &str) -> Result<&[u8]> {
        let end = self.at + count;
        let Some(bytes) = self.bytes.get(self.at..end) else {
            let value = format!("{} bytes", self.bytes.len() - self.at);
            let advice = format!("it takes {count}: the file is cut off");
            return Err(IoError::binary(self.path, self.at as u64, field, value, advice));
        };
        self.at = end;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, real_data, says};

    fn read(bytes: Vec<u8>) -> Result<Vec<ScanGraphNode>> {
        parse_scan_graph(Input::from_reader(std::io::Cursor::new(bytes), "a.graph".as_ref())?)
    }

    fn one_scan() -> Vec<u8> {
        let mut bytes = Vec::new();
        let whole = |bytes: &mut Vec<u8>, v: u32| bytes.extend(v.to_le_bytes());
        let vector = |bytes: &mut Vec<u8>, v: &[f64]| {
            whole(bytes, v.len() as u32);
            v.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        };
        whole(&mut bytes, 1);
        whole(&mut bytes, 2);
        vector(&mut bytes, &[1.0, 2.0, 3.0]);
        vector(&mut bytes, &[f64::NAN, 2.0, 3.0]);
        vector(&mut bytes, &[10.0, 0.0, 0.0]);
        vector(&mut bytes, &[0.0, 0.0, 0.0, 2.0]);
        whole(&mut bytes, 4);
        whole(&mut bytes, 0);
        bytes
    }

    #[test]
    fn the_layout() {
        let nodes = read(one_scan()).unwrap();
        let node = &nodes[0];
        assert_eq!((nodes.len(), node.id, &node.cloud.points[..]), (1, 4, &[[1.0, 2.0, 3.0]][..]));
        assert_eq!(node.cloud.refused.not_finite, 1);
        // Half a turn about z.
        assert_eq!(node.world_from_sensor.transform_point([1.0, 2.0, 3.0]), [9.0, -2.0, 3.0]);
    }

    #[test]
    fn errors_name_the_place_and_no_bytes_make_it_panic() {
        says(read(one_scan()[..20].to_vec()), "a.graph: byte 12: a point is 8 bytes; it takes 24");
        let mut wrong = one_scan();
        wrong[8] = 9;
        says(read(wrong), "byte 8: a point is 9 numbers; 3 are expected");
        no_panic(one_scan(), 3, 3000, read);
    }

    #[test]
    fn the_test_file_of_octomap() {
        let Some(path) = real_data("maps_octomap/spherical_scan.graph") else { return };
        let nodes = read_scan_graph(path).unwrap();
        assert_eq!((nodes.len(), nodes[0].cloud.points.len()), (1, 10_201));
        assert_eq!(nodes[0].world_from_sensor, Pose { translation: [1.0, 0.0, -0.5], ..Pose::IDENTITY });
        for p in &nodes[0].cloud.points {
            let range = p.iter().map(|v| v * v).sum::<f32>().sqrt();
            assert!((range - 4.01).abs() < 1e-3, "{range}");
        }
    }
}
