#![no_main]
portolan_fuzz::target!("colmap_text", portolan_fuzz::readers::colmap_text);
