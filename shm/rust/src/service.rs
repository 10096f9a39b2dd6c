// SPDX-License-Identifier: MIT
//! The service variant: iceoryx2's ipc service with every segment a file below
//! the root path.
//!
//! The stock variant puts world-writable segments into /dev/shm, and its open
//! loops for ever on a segment of length zero. As files in a folder of mode
//! 2750 they are for the group only, they can be looked at before they are
//! mapped, and removing the folder removes all there is. What iceoryx2 makes of them
//! after they are opened is in segment.rs.

use crate::members::MembersFamily;
use crate::segment::{Attendance, Contents, Segment, Table};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::arc_sync_policy::single_threaded::SingleThreaded;
use iceoryx2_cal::dynamic_storage::file::Storage;
use iceoryx2_cal::resizable_shared_memory::dynamic::DynamicMemory;
use iceoryx2_cal::shared_memory::common::details;
use iceoryx2_cal::shared_memory::process_local::Memory;
use iceoryx2_cal::shm_allocator::bump_allocator::BumpAllocator;
use iceoryx2_cal::shm_allocator::pool_allocator::PoolAllocator;
use std::fmt::Debug;

/// The value of a blackboard.
type ValueMemory =
    details::Memory<BumpAllocator, Segment<details::AllocatorDetails<BumpAllocator>, Contents>>;

#[derive(Debug, Clone)]
pub struct Files {}

impl iceoryx2::service::Service for Files {
    type StaticStorage = iceoryx2_cal::static_storage::recommended::Ipc;
    type ConfigSerializer = iceoryx2_cal::serialize::recommended::Recommended;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type Bag = MembersFamily;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Segment<T, Attendance>;
    type ServiceNameHasher = iceoryx2_cal::hash::recommended::Recommended;
    // Not used by blackboards. Who cleans up after a dead process would open what that process
    // names, and follow distances in it; there is nothing in this process.
    type SharedMemory = Memory<PoolAllocator>;
    type ResizableSharedMemory = DynamicMemory<PoolAllocator, Memory<PoolAllocator>>;
    type Connection = iceoryx2_cal::zero_copy_connection::process_local::Connection;
    // Not used: who waits looks at counters.
    type Event = iceoryx2_cal::event::recommended::Ipc;
    type Monitoring = iceoryx2_cal::monitoring::recommended::Ipc;
    type Reactor = iceoryx2_cal::reactor::recommended::Ipc;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = SingleThreaded<T>;
    type BlackboardMgmt<K: Send + Sync + Debug + ZeroCopySend + 'static> = Segment<K, Table>;
    type BlackboardPayload = ValueMemory;
    type UniqueId = iceoryx2::unique_id_generator::unique_system_id::UniqueSystemId;
}

impl iceoryx2::service::internal::ServiceInternal<Files> for Files {}
