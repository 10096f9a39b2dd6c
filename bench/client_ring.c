// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Ways with a bare ring (io_uring): as little around it as works, so that what
 * the daemon's transport adds shows.
 *
 *   ring        submit all questions and wait in one call for the first answer,
 *               then wait for the next: sleeps
 *   ring-spin   looks into the ring's memory instead
 *   ring-napi   as ring, but a wait polls the card first (NAPI)
 *
 * The traps are those of daemon/transport/uring.c: never wait for more than one,
 * arm the receive again when F_MORE is missing, give buffers back.
 */
#include <errno.h>
#include <liburing.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "bench/client.h"

enum { REGISTER_NAPI = 27, BUFFERS = 64, BUFFER = 256, NAPI_US = 50 };
enum { TOKEN_SEND = 1, TOKEN_RECEIVE = 2 };

struct napi {
	uint32_t us;
	uint8_t prefer, unused[3];
	uint32_t more[2];
};

static struct io_uring ring;
static struct io_uring_buf_ring *pool;
static uint8_t *buffers;
static bool armed;

static void give_back(int id)
{
	io_uring_buf_ring_add(pool, buffers + (size_t)id * BUFFER, BUFFER, (unsigned short)id,
			      BUFFERS - 1, 0);
	io_uring_buf_ring_advance(pool, 1);
}

static void arm(void)
{
	struct io_uring_sqe *sqe = io_uring_get_sqe(&ring);

	io_uring_prep_recv_multishot(sqe, 0, NULL, 0, 0);
	sqe->flags |= IOSQE_FIXED_FILE | IOSQE_BUFFER_SELECT;
	sqe->user_data = TOKEN_RECEIVE;
	armed = true;
}

static int make_buffers(void)
{
	int flags = MAP_ANONYMOUS | MAP_PRIVATE | MAP_POPULATE;
	struct io_uring_buf_reg registration = { .ring_entries = BUFFERS };
	int rc;

	pool = mmap(NULL, BUFFERS * sizeof(struct io_uring_buf), PROT_READ | PROT_WRITE, flags, -1,
		    0);
	buffers = mmap(NULL, BUFFERS * BUFFER, PROT_READ | PROT_WRITE, flags, -1, 0);
	if (pool == MAP_FAILED || buffers == MAP_FAILED)
		return -ENOMEM;
	registration.ring_addr = (uintptr_t)pool;
	rc = io_uring_register_buf_ring(&ring, &registration, 0);
	if (rc)
		return rc;
	io_uring_buf_ring_init(pool);
	for (int i = 0; i < BUFFERS; i++)
		give_back(i);
	return 0;
}

static const char *open_ring(struct client *c)
{
	struct io_uring_params p = {
		.flags = IORING_SETUP_SINGLE_ISSUER | IORING_SETUP_DEFER_TASKRUN |
			 IORING_SETUP_TASKRUN_FLAG | IORING_SETUP_SUBMIT_ALL | IORING_SETUP_CQSIZE,
		.cq_entries = 256,
	};

	if (io_uring_queue_init_params(64, &ring, &p) ||
	    io_uring_register_files(&ring, &c->fd, 1) || io_uring_register_ring_fd(&ring) != 1 ||
	    make_buffers())
		return "the kernel refuses the ring, or is older than 6.1";
	arm();
	return NULL;
}

static bool polled(const struct client *c)
{
	unsigned int id = 0;
	socklen_t size = sizeof(id);

	return !getsockopt(c->fd, SOL_SOCKET, SO_INCOMING_NAPI_ID, &id, &size) && id;
}

/* The socket knows what to poll only after it has received something. */
static const char *open_napi(struct client *c)
{
	const struct napi napi = { .us = NAPI_US, .prefer = 1 };
	const char *why = client_make_polled(c);

	if (why)
		return why;
	client_socket_ways[0].cycle(c);
	client_socket_ways[0].cycle(c);
	c->open = 0;
	if (!polled(c))
		return "the interface gives received packets no NAPI id";
	why = open_ring(c);
	if (!why && syscall(__NR_io_uring_register, ring.ring_fd, REGISTER_NAPI, &napi, 1) < 0)
		why = "the kernel cannot register NAPI with a ring (6.9 is needed)";
	return why;
}

static void send_all(struct client *c)
{
	client_stamp_all(c);
	for (int i = 0; i < c->ask.count; i++) {
		struct io_uring_sqe *sqe = io_uring_get_sqe(&ring);

		io_uring_prep_send(sqe, 0, c->ask.question[i], ASK_PACKET, MSG_DONTWAIT);
		sqe->flags |= IOSQE_FIXED_FILE | IOSQE_CQE_SKIP_SUCCESS;
		sqe->user_data = TOKEN_SEND;
	}
}

static void reap(struct client *c)
{
	struct io_uring_cqe *cqe;

	while (!io_uring_peek_cqe(&ring, &cqe)) {
		if (cqe->flags & IORING_CQE_F_BUFFER) {
			int id = (int)(cqe->flags >> IORING_CQE_BUFFER_SHIFT);

			client_take(c, buffers + (size_t)id * BUFFER, cqe->res);
			give_back(id);
		}
		if (cqe->user_data == TOKEN_RECEIVE && !(cqe->flags & IORING_CQE_F_MORE))
			armed = false;
		io_uring_cqe_seen(&ring, cqe);
	}
	if (!armed)
		arm();
}

static void cycle_sleeping(struct client *c)
{
	struct __kernel_timespec limit = { .tv_nsec = CLIENT_TIMEOUT_NS };
	struct io_uring_cqe *cqe;

	send_all(c);
	while (c->open && !client_late(c)) {
		io_uring_submit_and_wait_timeout(&ring, &cqe, 1, &limit, NULL);
		reap(c);
	}
}

static void cycle_spinning(struct client *c)
{
	send_all(c);
	while (c->open && !client_late(c)) {
		if (io_uring_sq_ready(&ring))
			io_uring_submit_and_get_events(&ring);
		reap(c);
	}
}

const struct client_way client_ring_ways[] = {
	{ "ring", false, open_ring, cycle_sleeping },
	{ "ring-spin", true, open_ring, cycle_spinning },
	{ "ring-napi", false, open_napi, cycle_sleeping },
	{ 0 },
};
