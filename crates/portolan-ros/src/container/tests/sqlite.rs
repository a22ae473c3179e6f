//! sqlite3: databases by the library in C (through Python), and small ones built by bytes.

use super::super::{Bag, BagOptions, ContainerKind, DefinitionFormat};
use super::support::{Written, content, holds, in_order, open, python, run, says};

const PAGE: usize = 1024;

fn varint(value: u64) -> Vec<u8> {
    let mut bytes = vec![(value & 0x7f) as u8];
    let mut rest = value >> 7;
    while rest > 0 {
        bytes.insert(0, 0x80 | (rest & 0x7f) as u8);
        rest >>= 7;
    }
    bytes
}

enum Value<'a> {
    Null,
    Int(i64),
    Text(&'a str),
    Blob(&'a [u8]),
}

fn row(values: &[Value<'_>]) -> Vec<u8> {
    let (mut types, mut body) = (Vec::new(), Vec::new());
    for value in values {
        match value {
            Value::Null => types.push(0),
            Value::Int(i) => {
                types.push(6);
                body.extend(i.to_be_bytes());
            }
            Value::Text(t) => {
                types.extend(varint(t.len() as u64 * 2 + 13));
                body.extend(t.as_bytes());
            }
            Value::Blob(b) => {
                types.extend(varint(b.len() as u64 * 2 + 12));
                body.extend(*b);
            }
        }
    }
    assert!(types.len() < 127);
    [vec![types.len() as u8 + 1], types, body].concat()
}

/// Appends the pages of a table of these rows and gives its root: leaves, and an interior page where there are several.
fn table(pages: &mut Vec<Vec<u8>>, rows: &[Vec<u8>], first_free: usize) -> u32 {
    let mut leaves: Vec<(u32, u64, Vec<Vec<u8>>)> = vec![(0, 0, Vec::new())];
    let mut room = PAGE - first_free - 8;
    for (i, payload) in rows.iter().enumerate() {
        let mut cell = [varint(payload.len() as u64), varint(i as u64 + 1)].concat();
        let (most, least) = (PAGE - 35, (PAGE - 12) * 32 / 255 - 23);
        if payload.len() <= most {
            cell.extend(payload);
        } else {
            let kept = least + (payload.len() - least) % (PAGE - 4);
            let local = if kept <= most { kept } else { least };
            cell.extend(&payload[..local]);
            cell.extend((pages.len() as u32 + 1).to_be_bytes());
            let parts: Vec<_> = payload[local..].chunks(PAGE - 4).collect();
            for (k, part) in parts.iter().enumerate() {
                let next = if k + 1 < parts.len() { pages.len() as u32 + 2 } else { 0 };
                let mut page = [&next.to_be_bytes()[..], part].concat();
                page.resize(PAGE, 0);
                pages.push(page);
            }
        }
        if room < cell.len() + 2 {
            leaves.push((0, 0, Vec::new()));
            room = PAGE - 8;
        }
        room -= cell.len() + 2;
        let leaf = leaves.last_mut().unwrap();
        leaf.1 = i as u64 + 1;
        leaf.2.push(cell);
    }
    let build = |kind: u8, at: usize, cells: &[Vec<u8>], right: Option<u32>| {
        let mut page = vec![0; PAGE];
        page[at] = kind;
        page[at + 3..at + 5].copy_from_slice(&(cells.len() as u16).to_be_bytes());
        let head = if right.is_some() { 12 } else { 8 };
        if let Some(right) = right {
            page[at + 8..at + 12].copy_from_slice(&right.to_be_bytes());
        }
        let mut end = PAGE;
        for (k, cell) in cells.iter().enumerate() {
            end -= cell.len();
            page[end..end + cell.len()].copy_from_slice(cell);
            page[at + head + 2 * k..at + head + 2 * k + 2].copy_from_slice(&(end as u16).to_be_bytes());
        }
        page
    };
    if first_free > 0 {
        pages[0] = build(13, first_free, &leaves[0].2, None);
        return 1;
    }
    for leaf in &mut leaves {
        pages.push(build(13, 0, &leaf.2, None));
        leaf.0 = pages.len() as u32;
    }
    let Some(((right, ..), others)) = leaves.split_last().filter(|(_, others)| !others.is_empty()) else {
        return leaves[0].0;
    };
    let cells: Vec<_> =
        others.iter().map(|(page, key, _)| [&page.to_be_bytes()[..], &varint(*key)].concat()).collect();
    pages.push(build(5, 0, &cells, Some(*right)));
    pages.len() as u32
}

/// A database of rosbag2.
pub(super) fn built(run: &[Written]) -> Vec<u8> {
    let mut pages = vec![Vec::new()];
    let profiles = "- history: 3\n  durability: 1\n";
    let topics: Vec<_> = ["/tf", "/scan"]
        .map(|name| {
            let format = Value::Text("cdr");
            row(&[Value::Null, Value::Text(name), Value::Text("a/msg/B"), format, Value::Text(profiles)])
        })
        .into();
    let id = |name: &str| if name == "/tf" { 1 } else { 2 };
    let message =
        |(n, t, b): &Written| row(&[Value::Null, Value::Int(id(n)), Value::Int(*t), Value::Blob(b)]);
    let messages: Vec<_> = run.iter().map(message).collect();
    let definitions =
        [row(&[Value::Null, Value::Text("a/msg/B"), Value::Text("ros2msg"), Value::Text("int32 x")])];
    let roots = [
        (
            "topics",
            "(id INTEGER PRIMARY KEY, name, type, serialization_format, offered_qos_profiles)",
            table(&mut pages, &topics, 0),
        ),
        ("messages", "(id INTEGER PRIMARY KEY, topic_id, timestamp, data)", table(&mut pages, &messages, 0)),
        (
            "message_definitions",
            "(id INTEGER PRIMARY KEY, topic_type, encoding, encoded_message_definition)",
            table(&mut pages, &definitions, 0),
        ),
    ];
    let schema = roots.map(|(name, columns, root)| {
        let sql = format!("CREATE TABLE {name}{columns}");
        let name = || Value::Text(name);
        row(&[Value::Text("table"), name(), name(), Value::Int(root.into()), Value::Text(&sql)])
    });
    table(&mut pages, &schema, 100);
    let count = pages.len() as u32;
    let head = &mut pages[0];
    head[..16].copy_from_slice(b"SQLite format 3\0");
    head[16..18].copy_from_slice(&(PAGE as u16).to_be_bytes());
    head[18..24].copy_from_slice(&[1, 1, 0, 64, 32, 32]);
    head[28..32].copy_from_slice(&count.to_be_bytes());
    head[59] = 1;
    pages.concat()
}

/// Rows, some with overflow pages.
fn long_run() -> Vec<Written> {
    let mut run = run(60);
    for (i, message) in run.iter_mut().enumerate() {
        message.2.extend(vec![i as u8; [0, 10, 300, 900, 5000][i % 5]]);
    }
    run
}

#[test]
fn rows_of_every_length_are_read() {
    let run = long_run();
    let file = built(&run);
    let bag = open(&[&file], false).unwrap();
    assert_eq!((bag.kind(), bag.notes().len()), (Some(ContainerKind::Sqlite3), 0));
    holds(&bag, &run);
    let topic = &bag.topics()[1];
    assert_eq!((topic.name.as_str(), topic.type_name.as_str()), ("/scan", "a/msg/B"));
    assert_eq!((topic.definition_format, topic.definition.as_str()), (DefinitionFormat::Ros2Msg, "int32 x"));
    assert!(topic.latched);
    holds(&open(&[&file], true).unwrap(), &run);
}

#[test]
fn a_cut_database_is_an_error_or_read_to_there() {
    let run = long_run();
    let file = built(&run);
    for cut in (100..file.len()).step_by(611) {
        says(open(&[&file[..cut]], false), "the number of pages is");
        let Ok(bag) = open(&[&file[..cut]], true) else { continue };
        assert!(!bag.notes().is_empty());
        let got = content(&bag).unwrap();
        assert!(got.len() <= run.len() && got.iter().all(|m| run.contains(m)));
    }
    // What is missing at the end is the table of definitions and the root of the messages: without the last page but one
    // nothing is found, and that is told.
    let bag = open(&[&file[..PAGE * 3]], true);
    assert!(bag.is_err() || !bag.unwrap().notes().is_empty());
}

#[test]
fn pages_that_loop_are_found() {
    let run = long_run();
    let good = built(&run);
    let interior = good.chunks(PAGE).position(|p| p[0] == 5).unwrap();
    let mut file = good.clone();
    file[interior * PAGE + 8..interior * PAGE + 12].copy_from_slice(&(interior as u32 + 1).to_be_bytes());
    says(open(&[&file], false), "a page is twice in one table");
    assert!(open(&[&file], true).unwrap().notes()[0].contains("1 pages and 0 single messages"));
    // Every overflow page leads to itself: the bytes are wrong, and the end is reached.
    let mut file = good;
    for (i, page) in file.chunks_mut(PAGE).enumerate().skip(1) {
        if page[0] == 0 {
            page[..4].copy_from_slice(&(i as u32 + 1).to_be_bytes());
        }
    }
    assert_eq!(content(&open(&[&file], false).unwrap()).unwrap().len(), run.len());
}

#[test]
fn other_databases_are_refused() {
    let file = built(&run(3));
    let mut other = file.clone();
    for at in 0..other.len() - 8 {
        if other[at..].starts_with(b"messages") {
            other[at] = b'x';
        }
    }
    says(open(&[&other], false), "without the tables `topics` and `messages`");
    let mut proto = file;
    let at = proto.windows(3).rposition(|w| w == b"cdr").unwrap();
    proto[at..at + 3].copy_from_slice(b"xyz");
    let bag = open(&[&proto], false).unwrap();
    assert!(
        bag.notes()[0].contains("written as \"xyz\", which is not read (1 messages left out)"),
        "{:?}",
        bag.notes()
    );
}

#[test]
fn changes_beside_a_database_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    std::fs::write(&path, built(&run(5))).unwrap();
    let open = |allow_truncated| Bag::open(&path, &BagOptions { allow_truncated });
    std::fs::write(folder.path().join("run.db3-wal"), b"").unwrap();
    std::fs::write(folder.path().join("run.db3-journal"), [0; 100]).unwrap();
    assert!(open(false).unwrap().notes().is_empty());
    std::fs::write(folder.path().join("run.db3-wal"), b"pages").unwrap();
    says(open(false), "has changes in");
    assert!(open(true).unwrap().notes()[0].contains("left out"));
}

/// Databases of every page size, text encoding and history, by the library itself, and what it says that they hold.
const SCRIPT: &str = r#"
import binascii, random, sqlite3, sys
rng = random.Random(int(sys.argv[2])); path = sys.argv[1]
db = sqlite3.connect(path, isolation_level=None)
size = rng.choice([512, 1024, 4096, 65536])
db.execute('pragma synchronous=off'); db.execute('pragma page_size=%d' % size); db.execute('pragma auto_vacuum=%d' % rng.choice([0, 1, 2]))
db.execute("pragma encoding='%s'" % rng.choice(['UTF-8', 'UTF-16le', 'UTF-16be']))
cols = ['id INTEGER PRIMARY KEY', 'topic_id INTEGER NOT NULL', 'timestamp INTEGER NOT NULL', 'data BLOB NOT NULL']
if rng.random() < .5: rng.shuffle(cols)
db.execute('create table topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL)')
db.execute('create table messages(%s)' % ', '.join(cols)); db.execute('create index timestamp_idx on messages (timestamp asc)')
for i in range(1, 40): db.execute('insert into topics values(?,?,?,?)', (i, '/t\u00f6pic%d' % i, 'a/msg/B', 'cdr'))
db.execute('begin')
for i in range(400):
    length = rng.choice([0, rng.randint(0, size), rng.randint(size - 60, size), rng.randint(0, 4 * size)])
    db.execute('insert into messages(topic_id,timestamp,data) values(?,?,?)', (rng.randint(1, 39), rng.choice([0, 1, -5, 127, 2**40, rng.randint(0, 2**62)]), b'\0' + rng.randbytes(length)))
db.execute('commit')
if rng.random() < .5: db.execute('delete from messages where rowid % 3 = 0')
if rng.random() < .3: db.execute('insert into messages(id,topic_id,timestamp,data) values(-7,1,9,zeroblob(3000))')
if rng.random() < .3: db.execute('vacuum')
if rng.random() < .3: db.execute('alter table messages add column extra text')
for name, time, data in db.execute('select name,timestamp,data from messages join topics on topic_id=topics.id order by timestamp,messages.id'):
    print(name[2:].replace('\u00f6', 'o'), time, binascii.crc32(data))
"#;

#[test]
fn the_library_and_this_reader_agree() {
    for seed in 0..12u32 {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.db3");
        let number = seed.to_string();
        let Some(expected) = python("sqlite3", SCRIPT, &[&path, number.as_ref()]) else { return };
        let bag = Bag::open(&path, &BagOptions::default()).unwrap();
        let got: String = content(&bag)
            .unwrap()
            .iter()
            .map(|(n, t, b)| format!("{} {t} {}\n", n.replace("/tö", "o"), crc32fast::hash(b)))
            .collect();
        assert!(got == expected, "seed {seed}");
    }
    assert_eq!(in_order(&[]).len(), 0);
}
