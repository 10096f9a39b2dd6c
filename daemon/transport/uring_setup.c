/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Making the ring.
 *
 * The order matters. The ring is born disabled (R_DISABLED): while it is, any
 * thread may register things with it. Then restrictions are laid on it - it
 * can only send and receive, only through its fixed sockets, and nothing can
 * be registered any more - because a seccomp filter does not see what a ring
 * does. Then start() enables it, and since the ring is SINGLE_ISSUER the
 * thread that enables is the only one which may ever enter it: a second one
 * gets EEXIST. So start() is called by the realtime thread, and everything
 * that needs registering is done before.
 *
 * Also here: the registered ring descriptor (belongs to a thread, so start()
 * again), a limit of one io-wq worker of each kind (UDP needs none; a mistake
 * would show as one thread, not as a hundred), and NAPI busy polling where
 * the kernel has it.
 *
 * liburing 2.3 has no helper for half of this, and its shared object does not
 * export io_uring_enable_rings or io_uring_register_restrictions, so
 * registering is done by the system call itself.
 */
#include <errno.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "daemon/transport/uring.h"

enum { REGISTER_NAPI = 27 }; /* Linux 6.9 */
enum { BUFFER_GROUP = 0 };

struct napi_request {
	uint32_t timeout_us;
	uint8_t prefer, opcode, pad[2];
	uint32_t parameter, reserved;
};

static int ring_register(struct uring *u, unsigned int operation, const void *argument,
			 unsigned int count)
{
	long rc = syscall(__NR_io_uring_register, u->ring.ring_fd, operation, argument, count);

	return rc < 0 ? -errno : (int)rc;
}

static int restrict_ring(struct uring *u)
{
	const struct io_uring_restriction only[] = {
		{ .opcode = IORING_RESTRICTION_SQE_OP, .sqe_op = IORING_OP_SEND },
		{ .opcode = IORING_RESTRICTION_SQE_OP, .sqe_op = IORING_OP_RECVMSG },
		{ .opcode = IORING_RESTRICTION_SQE_FLAGS_ALLOWED,
		  .sqe_flags = IOSQE_FIXED_FILE | IOSQE_BUFFER_SELECT | IOSQE_CQE_SKIP_SUCCESS },
		{ .opcode = IORING_RESTRICTION_SQE_FLAGS_REQUIRED, .sqe_flags = IOSQE_FIXED_FILE },
		{ .opcode = IORING_RESTRICTION_REGISTER_OP,
		  .register_op = IORING_UNREGISTER_RING_FDS },
	};

	return ring_register(u, IORING_REGISTER_RESTRICTIONS, only, sizeof only / sizeof only[0]);
}

static int register_files(struct uring *u)
{
	int none[TRANSPORT_CHANNELS];

	memset(none, 0xff, sizeof none);
	return ring_register(u, IORING_REGISTER_FILES, none, TRANSPORT_CHANNELS);
}

static int register_buffers(struct uring *u)
{
	struct io_uring_buf_reg pool = {
		.ring_entries = u->sizes.buffers,
		.bgid = BUFFER_GROUP,
	};
	int rc;

	u->pool = transport_memory_map(u->sizes.buffers * sizeof(struct io_uring_buf));
	u->buffers = transport_memory_map((size_t)u->sizes.buffers * URING_BUFFER);
	if (!u->pool || !u->buffers)
		return -ENOMEM;
	pool.ring_addr = (uintptr_t)u->pool;
	rc = ring_register(u, IORING_REGISTER_PBUF_RING, &pool, 1);
	if (rc < 0)
		return rc;
	io_uring_buf_ring_init(u->pool);
	for (unsigned int i = 0; i < u->sizes.buffers; i++)
		uring_recycle(u, (int)i);
	return 0;
}

static int make_ring(struct uring *u)
{
	struct io_uring_params p = {
		.flags = IORING_SETUP_R_DISABLED | IORING_SETUP_SINGLE_ISSUER |
			 IORING_SETUP_DEFER_TASKRUN | IORING_SETUP_TASKRUN_FLAG |
			 IORING_SETUP_SUBMIT_ALL | IORING_SETUP_CQSIZE,
		.cq_entries = u->sizes.completions,
	};
	int rc = io_uring_queue_init_params(u->sizes.submissions, &u->ring, &p);

	if (rc < 0)
		return rc;
	u->ring_open = true;
	/*
	 * Submission i is always in entry i: filled in once, never touched again. liburing 2.6 and
	 * newer ask the kernel (6.6 and newer) for a ring without this array, where that is so
	 * anyway.
	 */
	for (unsigned int i = 0; u->ring.sq.array && i < u->sizes.submissions; i++)
		u->ring.sq.array[i] = i;
	return 0;
}

static int prepare_ring(struct uring *u)
{
	unsigned int workers[2] = { 1, 1 };
	int rc;

	rc = make_ring(u);
	if (rc == 0)
		rc = register_files(u);
	if (rc == 0)
		rc = register_buffers(u);
	if (rc == 0)
		rc = ring_register(u, IORING_REGISTER_IOWQ_MAX_WORKERS, workers, 2);
	if (rc == 0 && u->options.busy_poll_us) {
		struct napi_request napi = { .timeout_us = u->options.busy_poll_us, .prefer = 1 };

		/* A wish, as in udp.c: many interfaces and kernels cannot. */
		ring_register(u, REGISTER_NAPI, &napi, 1);
	}
	return rc < 0 ? rc : 0;
}

static void release(struct uring *u)
{
	struct io_uring_rsrc_update own = { .offset = (uint32_t)u->enter_fd };

	/* Fails in another thread than the one that started; that one's exit does it. */
	if (u->ring_open && u->enter_flags & IORING_ENTER_REGISTERED_RING)
		ring_register(u, IORING_UNREGISTER_RING_FDS, &own, 1);
	if (u->ring_open)
		io_uring_queue_exit(&u->ring);
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		udp_close(&u->channel[i].udp);
	transport_memory_unmap(u->pool, u->sizes.buffers * sizeof(struct io_uring_buf));
	transport_memory_unmap(u->buffers, (size_t)u->sizes.buffers * URING_BUFFER);
}

int uring_open_sized(struct uring *u, const struct transport_options *options,
		     const struct uring_sizes *sizes)
{
	int rc;

	u->options = *options;
	u->sizes = *sizes;
	u->lent = -1;
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		u->channel[i].udp.fd = -1;
	rc = prepare_ring(u);
	if (rc < 0)
		release(u);
	return rc;
}

int transport_probe_ring(int *napi)
{
	struct napi_request request = { .timeout_us = 1, .prefer = 1 };
	struct uring *u = transport_memory_map(sizeof(*u));
	int rc;

	*napi = -ENOSYS;
	if (!u)
		return -ENOMEM;
	rc = uring_open_sized(u, &(struct transport_options){ 0 },
			      &(struct uring_sizes){ 4, 8, 4 });
	if (rc == 0) {
		*napi = ring_register(u, REGISTER_NAPI, &request, 1);
		*napi = *napi < 0 ? *napi : 0;
		release(u);
	}
	transport_memory_unmap(u, sizeof(*u));
	return rc;
}

int uring_open(struct transport *t, const struct transport_options *options)
{
	static const struct uring_sizes sizes = {
		URING_SUBMISSIONS,
		URING_COMPLETIONS,
		URING_BUFFERS,
	};

	return uring_open_sized((struct uring *)t, options, &sizes);
}

void uring_close(struct transport *t)
{
	release((struct uring *)t);
	transport_memory_unmap(t, sizeof(struct uring));
}

int uring_attach(struct transport *t, uint32_t channel)
{
	struct uring *u = (struct uring *)t;
	struct io_uring_files_update update;
	struct uring_channel *c;
	int rc;

	if (channel >= TRANSPORT_CHANNELS)
		return -EINVAL;
	c = &u->channel[channel];
	if (u->started || c->udp.fd >= 0)
		return -EBUSY;
	rc = udp_open(&c->udp, &u->options);
	if (rc < 0)
		return rc;
	c->shape.msg_namelen = sizeof(struct sockaddr_in);
	c->shape.msg_controllen = UDP_CONTROL;
	update = (struct io_uring_files_update){ .offset = channel, .fds = (uintptr_t)&c->udp.fd };
	rc = ring_register(u, IORING_REGISTER_FILES_UPDATE, &update, 1);
	if (rc < 0) {
		udp_close(&c->udp);
		return rc;
	}
	if (channel >= u->channels)
		u->channels = channel + 1;
	return 0;
}

/* Waits name their deadline absolutely where the kernel can (6.12), else relatively. */
static int probe_absolute(struct uring *u)
{
	const uint64_t past = 1;
	int rc;

	u->enter_flags |= URING_ABS_TIMER;
	rc = uring_enter(u, 0, &past);
	if (rc == -EINVAL) {
		u->enter_flags &= ~URING_ABS_TIMER;
		rc = uring_enter(u, 0, &past);
	}
	return rc == -ETIME || rc == -EINTR || rc == -EAGAIN ? 0 : rc;
}

int uring_start(struct transport *t)
{
	struct uring *u = (struct uring *)t;
	struct io_uring_rsrc_update own;
	int rc;

	if (u->started)
		return -EBUSY;
	own = (struct io_uring_rsrc_update){ .offset = UINT32_MAX,
					     .data = (uint32_t)u->ring.ring_fd };
	u->enter_fd = u->ring.ring_fd;
	if (ring_register(u, IORING_REGISTER_RING_FDS, &own, 1) == 1) {
		u->enter_fd = (int)own.offset;
		u->enter_flags = IORING_ENTER_REGISTERED_RING;
	}
	rc = restrict_ring(u);
	if (rc == 0)
		rc = ring_register(u, IORING_REGISTER_ENABLE_RINGS, NULL, 0);
	if (rc < 0)
		return rc;
	u->started = true;
	stamp_read(&u->stamp);
	uring_arm(u);
	rc = probe_absolute(u);
	t->statistics.system_calls = 0;
	return rc < 0 ? rc : 0;
}

const struct transport_kind transport_uring = {
	.ops = &uring_ops,
	.size = sizeof(struct uring),
};
