//! Every file format that portolan reads or writes, one file each.
