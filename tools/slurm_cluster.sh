# A Slurm cluster of two nodes on one machine, everything in one folder: sourced by slurm_test.sh.
#
#   cluster_start FOLDER   munge, slurmctld and the nodes n1 and n2
#   cluster_kill NODE      the node's daemon and all it runs end at once, as if the power were cut
#   cluster_boot NODE      the node comes (back) up
#   cluster_stop           everything ends
#
# Needs root (each node is a PID namespace, so that killing its first process kills the node) and Debian's munge and slurm-wlm.

cluster_missing() {
    local tool
    [ "$(id -u)" = 0 ] || { echo "not root"; return; }
    for tool in munged munge slurmctld slurmd sbatch squeue scontrol unshare; do
        PATH="$PATH:/usr/sbin:/sbin" command -v "$tool" >/dev/null || { echo "no $tool (apt-get install munge slurm-wlm)"; return; }
    done
}

cluster_start() {
    CLUSTER="$1"
    export PATH="$PATH:/usr/sbin:/sbin" SLURM_CONF="$CLUSTER/slurm.conf"
    declare -gA CLUSTER_PIDS=()
    local node host port=$((20000 + $$ % 20000))
    host=$(hostname -s)
    mkdir -p "$CLUSTER"/{state,n1,n2}
    chmod 755 "$CLUSTER"
    dd if=/dev/urandom of="$CLUSTER/munge.key" bs=128 count=1 status=none
    chmod 600 "$CLUSTER/munge.key"
    cat >"$SLURM_CONF" <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
# A task of a lost node is started again when its credential has expired; the default is two minutes.
AuthInfo=socket=$CLUSTER/munge.socket,cred_expire=5
CredType=cred/munge
SlurmctldPort=$port
SlurmctldPidFile=$CLUSTER/slurmctld.pid
SlurmctldLogFile=$CLUSTER/slurmctld.log
SlurmdPidFile=$CLUSTER/%n/pid
SlurmdLogFile=$CLUSTER/%n/log
SlurmdSpoolDir=$CLUSTER/%n
StateSaveLocation=$CLUSTER/state
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
SlurmdTimeout=8
KillWait=3
MinJobAge=3600
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1
PartitionName=farm Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
    munged --foreground --force --key-file="$CLUSTER/munge.key" --socket="$CLUSTER/munge.socket" --pid-file="$CLUSTER/munged.pid" \
        --log-file="$CLUSTER/munged.log" --seed-file="$CLUSTER/munged.seed" >/dev/null 2>&1 &
    CLUSTER_PIDS[munged]=$!
    until [ -S "$CLUSTER/munge.socket" ]; do sleep 0.1; kill -0 "${CLUSTER_PIDS[munged]}"; done
    slurmctld -D -c >"$CLUSTER/slurmctld.out" 2>&1 &
    CLUSTER_PIDS[slurmctld]=$!
    for node in n1 n2; do cluster_boot "$node"; done
    cluster_wait_up n1 n2
}

cluster_boot() {
    unshare --pid --fork --kill-child --mount-proc slurmd -D -N "$1" >"$CLUSTER/$1/out" 2>&1 &
    CLUSTER_PIDS[$1]=$!
}

# Waits until the nodes can take work.
cluster_wait_up() {
    local node tries=0
    for node in "$@"; do
        until sinfo -h -n "$node" -o %t 2>/dev/null | grep -qE '^(idle|mix|alloc)$'; do
            sleep 0.5
            tries=$((tries + 1))
            [ $tries -lt 40 ] || { echo "node $node does not come up" >&2; tail -n 20 "$CLUSTER/slurmctld.log" "$CLUSTER/$node/log" >&2; return 1; }
        done
    done
}

cluster_kill() {
    kill -KILL "${CLUSTER_PIDS[$1]}"
    wait "${CLUSTER_PIDS[$1]}" 2>/dev/null || true
    unset "CLUSTER_PIDS[$1]"
}

cluster_stop() {
    local name
    for name in n1 n2 slurmctld munged; do
        [ -z "${CLUSTER_PIDS[$name]:-}" ] || { kill -KILL "${CLUSTER_PIDS[$name]}" 2>/dev/null; wait "${CLUSTER_PIDS[$name]}" 2>/dev/null; } || true
    done
    CLUSTER_PIDS=()
}
