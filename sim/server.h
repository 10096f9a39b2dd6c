/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_SERVER_H
#define SIM_SERVER_H

/*
 * The sockets of pokeys-sim around one rig. One thread, one epoll; the clock
 * of the rig is CLOCK_MONOTONIC. Everything below is of this process only:
 * fixed numbers of clients, no allocation while serving.
 */

#include <netinet/in.h>
#include <stdbool.h>
#include <sys/socket.h>

#include "sim/control.h"
#include "sim/options.h"
#include "sim/script.h"

#define SIM_TCP_CLIENTS 16
#define SIM_CONTROL_CLIENTS 8
#define SIM_TCP_SEND 4096
#define SIM_UDP_BATCH 64

/* What an epoll event is about; the index of the client stands beside it. */
enum sim_event {
	SIM_EVENT_UDP,
	SIM_EVENT_SEARCH,
	SIM_EVENT_LISTEN,
	SIM_EVENT_TCP,
	SIM_EVENT_CONTROL_LISTEN,
	SIM_EVENT_CONTROL,
	SIM_EVENT_SIGNAL,
};

struct sim_tcp_client {
	int fd;              /* -1 free */
	uint32_t watched;    /* events of epoll it is watched for */
	bool ended;          /* it will say nothing more, but may listen */
	bool broken;         /* it is gone, but has left requests */
	uint16_t generation; /* tells its replies from those of one before */
	uint64_t active_ns;  /* it last said something, waited or took a reply */
	size_t received;
	uint8_t in[SIM_MULTI];
	size_t to_send;
	uint8_t out[SIM_TCP_SEND];
};

/* Packets that one system call takes in or sends; one byte more, for those that are too long. */
struct sim_udp_batch {
	struct mmsghdr message[SIM_UDP_BATCH];
	struct iovec part[SIM_UDP_BATCH];
	struct sockaddr_in peer[SIM_UDP_BATCH];
	uint8_t bytes[SIM_UDP_BATCH][SIM_LINK_BYTES + 1];
};

struct sim_control_client {
	int fd;
	size_t received;
	char line[SIM_CONTROL_LINE];
};

struct sim_server {
	const struct sim_options *options;
	struct sim_rig *rig;
	struct sim_control control;
	struct sim_script *script; /* NULL none */
	uint64_t start_ns;
	uint64_t reboots; /* of the device, seen so far */
	uint16_t port;    /* in use */
	int epoll;
	int udp;
	int search; /* for broadcasts; -1 when switched off or not to be had */
	int listen;
	int control_listen;
	int signals;
	bool stop;
	struct sim_udp_batch requests, replies;
	unsigned int to_reply; /* replies which wait for sim_udp_flush() */
	struct sim_tcp_client tcp[SIM_TCP_CLIENTS];
	struct sim_control_client controller[SIM_CONTROL_CLIENTS];
};

/* CLOCK_MONOTONIC in nanoseconds. */
uint64_t sim_now(void);

/*
 * Opens all sockets. 0, or -errno after one clear line on stderr. On failure
 * what was opened is closed again.
 */
int sim_server_open(struct sim_server *server, const struct sim_options *options,
		    struct sim_rig *rig, struct sim_script *script);

/* Serves until SIGTERM, SIGINT or "exit"; 0, or -errno with a line on stderr. */
int sim_server_run(struct sim_server *server);

void sim_server_close(struct sim_server *server);

/* server.c: watches a descriptor; 0 or -errno. */
int sim_server_watch(struct sim_server *server, int fd, enum sim_event event, unsigned int index);

/* server_udp.c */
int sim_udp_open(struct sim_server *server);
void sim_udp_receive(struct sim_server *server);
void sim_udp_send(struct sim_server *server, uint64_t peer, const uint8_t *bytes, size_t len);
void sim_udp_flush(struct sim_server *server);

/* server_search.c */
int sim_search_open(struct sim_server *server);
void sim_search_receive(struct sim_server *server, uint64_t now_ns);
void sim_search_asked(struct sim_server *server, uint64_t now_ns, const struct sockaddr_in *from);

/* server_tcp.c */
int sim_tcp_open(struct sim_server *server);
void sim_tcp_accept(struct sim_server *server, uint64_t now_ns);
void sim_tcp_receive(struct sim_server *server, uint64_t now_ns, unsigned int index);
void sim_tcp_broken(struct sim_server *server, unsigned int index);
void sim_tcp_send(struct sim_server *server, uint64_t now_ns, uint64_t peer, const uint8_t *bytes,
		  size_t len);
void sim_tcp_keep(struct sim_server *server, uint64_t now_ns);
uint64_t sim_tcp_next(const struct sim_server *server);
void sim_tcp_close_all(struct sim_server *server);

/* server_control.c */
int sim_control_open(struct sim_server *server);
void sim_control_accept(struct sim_server *server);
void sim_control_receive(struct sim_server *server, uint64_t now_ns, unsigned int index);
void sim_control_close(struct sim_server *server);

/* ctl.c: the client, `pokeys-sim --ctl SOCKET COMMAND...`; the exit status. */
int sim_ctl(int argc, char **argv);

#endif
