//! Vertices as a cloud of points, range scans with their rows and columns.

use std::path::Path;

use super::body::Body;
use super::header::{self, Element, Header};
use crate::bytes::{Input, Scalar, open};
use crate::points::{CloudBuilder, CloudGrid, PointCloudFile, PointFields, is_time, most_bytes};
use crate::{IoError, Result};

/// The most pixels of a range grid.
const MOST_PIXELS: u64 = 1 << 30;

/// Reads the vertices of a PLY file, with intensity, time, normals and colors where it has them, and with the rows and
/// columns of its `range_grid` (whose size is in `obj_info num_cols` and `num_rows`). In a range scan the points are in the
/// order of pixels.
///
/// # Errors
/// [`IoError::Text`] for a wrong header or text, [`IoError::Binary`] for wrong binary data, both for a grid that names
/// vertices that are not there or names one twice.
pub fn read_ply_cloud(path: impl AsRef<Path>) -> Result<PointCloudFile> {
    parse(open(path)?)
}

pub(crate) fn parse(mut input: Input) -> Result<PointCloudFile> {
    let bytes = input.read_all(most_bytes(&input))?;
    parse_bytes(&bytes, input.path())
}

pub(super) fn parse_bytes(bytes: &[u8], path: &Path) -> Result<PointCloudFile> {
    let header = header::parse(bytes, path)?;
    let mut body = Body::of(&header, bytes, path);
    let mut cloud = None;
    let mut vertices = Vertices::default();
    for element in &header.elements {
        match (element.name.as_str(), cloud.as_mut()) {
            ("vertex" | "point", None) => {
                let with_grid = header.elements.iter().any(|e| e.name == "range_grid");
                cloud = Some(read_vertices(&mut body, element, with_grid, &mut vertices, path)?);
            }
            ("range_grid", Some(cloud)) => read_grid(&mut body, &header, element, &vertices, cloud)?,
            _ => {
                for _ in 0..element.count {
                    body.row(element, None)?;
                }
            }
        }
    }
    body.check_end()?;
    cloud.ok_or_else(|| {
        let names: Vec<_> = header.elements.iter().map(|e| e.name.as_str()).collect();
        let value = crate::error::shown(names.join(" "));
        IoError::text(path, header.body_line - 1, "the elements", value, "give a file with vertices")
    })
}

/// The point of each vertex of the file, `None` where it was refused.
#[derive(Default)]
struct Vertices(Vec<Option<u32>>);

/// The places of a vertex's properties.
fn fields_of(element: &Element) -> Option<PointFields<(usize, Scalar)>> {
    let red = &["red", "r", "diffuse_red"][..];
    let mut names = element.properties.iter().map(|p| p.name.as_str());
    Some(PointFields {
        position: element.three([&["x"], &["y"], &["z"]])?,
        intensity: element.value(&["intensity", "scalar_intensity", "reflectance", "reflectivity"]),
        normal: element.three([&["nx"], &["ny"], &["nz"]]),
        color: element.three([red, &["green", "g", "diffuse_green"], &["blue", "b", "diffuse_blue"]]),
        ring: element.value(&["ring"]),
        time: names.find(|n| is_time(n)).and_then(|n| element.value(&[n])),
    })
}

fn read_vertices(
    body: &mut Body,
    element: &Element,
    with_grid: bool,
    vertices: &mut Vertices,
    path: &Path,
) -> Result<PointCloudFile> {
    let Some(fields) = fields_of(element) else {
        let (field, value) = ("the properties of vertices", "without x, y, z");
        return Err(IoError::text(path, 1, field, value, "give a file with points"));
    };
    let mut builder = CloudBuilder::new(true);
    for i in 0..element.count {
        body.row(element, None)?;
        let values = &body.values;
        let kept = builder.push_fields(i as usize, &fields, |(k, scalar)| (values[k], scalar));
        if with_grid {
            vertices.0.push(kept.then(|| builder.cloud.points.len() as u32 - 1));
        }
    }
    Ok(builder.finish())
}

/// Puts the points into the order of their pixels.
fn read_grid(
    body: &mut Body,
    header: &Header,
    element: &Element,
    vertices: &Vertices,
    cloud: &mut PointCloudFile,
) -> Result<()> {
    let size = header.columns.zip(header.rows).map(|(c, r)| (c, r, c.saturating_mul(r)));
    let Some((columns, rows, _)) = size.filter(|s| s.2 == element.count && s.2 <= MOST_PIXELS) else {
        let value = format!("{:?} x {:?} for {} pixels", header.columns, header.rows, element.count);
        let advice = "write the columns and rows of range_grid";
        return Err(body.error("obj_info num_cols, num_rows", value, advice));
    };
    let wanted = element.indices();
    let (mut order, mut pixels) = (Vec::new(), Vec::new());
    let mut taken = vec![false; cloud.points.len()];
    for pixel in 0..element.count {
        body.row(element, wanted)?;
        let Some(&index) = body.list.first() else {
            cloud.refused.no_reading += 1;
            continue;
        };
        let vertex = (index >= 0.0 && body.list.len() == 1).then(|| vertices.0.get(index as usize)).flatten();
        let Some(vertex) = vertex else {
            let advice = format!("a pixel has no vertex, or one of {}", vertices.0.len());
            return Err(body.error("range_grid", format!("{:?}", body.list), advice));
        };
        // A refused vertex was counted where it was read.
        let Some(point) = *vertex else { continue };
        if std::mem::replace(&mut taken[point as usize], true) {
            return Err(body.error("range_grid", format!("{index} again"), "give each vertex one pixel"));
        }
        order.push(point as usize);
        pixels.push(pixel as u32);
    }
    // Points without a pixel are no part of the image; scanners do not write any.
    cloud.refused.no_reading += (cloud.points.len() - order.len()) as u64;
    reorder(&mut cloud.points, &order);
    reorder(&mut cloud.intensity, &order);
    reorder(&mut cloud.times, &order);
    reorder(&mut cloud.rings, &order);
    reorder(&mut cloud.colors, &order);
    reorder(&mut cloud.normals, &order);
    cloud.grid = Some(CloudGrid { columns: columns as usize, rows: rows as usize, pixels });
    Ok(())
}

fn reorder<T: Copy>(list: &mut Vec<T>, order: &[usize]) {
    if !list.is_empty() {
        *list = order.iter().map(|&i| list[i]).collect();
    }
}
