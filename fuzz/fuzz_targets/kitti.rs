#![no_main]
portolan_fuzz::target!("kitti", portolan_fuzz::readers::kitti);
