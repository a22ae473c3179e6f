#![no_main]
portolan_fuzz::target!("colmap_binary", portolan_fuzz::readers::colmap_binary);
